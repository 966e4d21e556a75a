"""Teams that take off, fly and land by themselves, with lossy links; and teams that lose a vehicle."""

import itertools

import numpy as np
import pytest

from relform_analysis.flight.metrics import flight_metrics
from relform_analysis.flight.simulate import fly_in_process, simulate
from relform_controller.flight_director import FlightDirector
from relform_core.flight_modes import TeamMode, TeamRequest, VehicleMode
from relform_core.load import LoadedScenario, load_scenario
from relform_core.telemetry import RequestMade
from support.scenarios import CONFIG_FOLDER

FIELD = CONFIG_FOLDER / "scenarios/field.yaml"
WAITING = ("ground.waits=true", "ground.time_s=40")


def field(*overrides: str, seed: int) -> LoadedScenario:
    return load_scenario(FIELD, overrides, seed)


def link_fault(vehicle: str, direction: str, until: int) -> str:
    """Override: everything is lost in this direction from 14 s on."""
    where = f"target: {vehicle}, direction: {direction}"
    return f"events=[{{kind: link, {where}, loss_probability: 1.0, start_s: 14, end_s: {until}}}]"


def modes_of(scenario: LoadedScenario, requests: dict[float, TeamRequest]) -> list[tuple[TeamMode, str]]:
    """Modes and reasons, one after the other, of a flight with requests at some times [s]."""
    director = FlightDirector(scenario.config)
    seen: list[tuple[TeamMode, str]] = []
    queue = dict(sorted(requests.items()))
    for step in simulate(scenario, director):
        assert not step.faults
        if step.status is not None and (step.status.mode, step.status.reason) not in seen[-1:]:
            seen.append((step.status.mode, step.status.reason))
        time = step.measurements.arrival_ns / 1e9
        for due in [each for each in queue if each <= time]:
            director.request(RequestMade(queue.pop(due)))
    return seen


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_scenario_is_flown_from_the_ground_and_back(seed: int) -> None:
    scenario = field(seed=seed)
    log = fly_in_process(scenario)
    metrics = flight_metrics(log)
    modes = [entry.description for entry in log.changes if entry.source == "team"]
    assert modes == ["idle", "taking off", "hovering", "flying", "hovering", "landing", "idle"]
    assert not log.faults
    height = scenario.config.vehicle.leg_height
    for instant in (0, -1):
        assert log.p_NB_N[instant, :, 2] == pytest.approx(np.full(3, height), abs=0.02)
    assert metrics.score.formation.steady.mean < 0.03
    assert metrics.score.leader_position.steady.mean < 0.05
    assert metrics.separation_min > 0.8
    assert [phase.steps for phase in metrics.phases] == [100, 100, 120]


def test_a_second_flight_follows_the_first() -> None:
    requests = {
        0.5: TeamRequest.TAKE_OFF,
        12.0: TeamRequest.LAND,
        22.0: TeamRequest.TAKE_OFF,
        34.0: TeamRequest.EMERGENCY_LAND,
    }
    modes = [mode for mode, _ in modes_of(field(*WAITING, "ground.landing=together", seed=4), requests)]
    once = [TeamMode.IDLE, TeamMode.TAKING_OFF, TeamMode.HOVERING, TeamMode.LANDING]
    assert modes == [*once, *once] or modes == [*once, *once, TeamMode.IDLE]


def test_a_team_lands_when_a_vehicle_is_not_heard() -> None:
    silent = link_fault("follower_1", "up", until=17)
    seen = modes_of(field(*WAITING, silent, seed=5), {0.5: TeamRequest.TAKE_OFF})
    assert seen[3] == (TeamMode.FAILSAFE, "nothing was heard from follower_1 for 1 s")
    assert [mode for mode, _ in seen] == [
        TeamMode.IDLE,
        TeamMode.TAKING_OFF,
        TeamMode.HOVERING,
        TeamMode.FAILSAFE,
        TeamMode.IDLE,
    ]


def test_a_vehicle_that_hears_nothing_descends_and_the_team_lands() -> None:
    deaf = link_fault("follower_2", "down", until=40)
    seen = modes_of(field(*WAITING, deaf, seed=6), {0.5: TeamRequest.TAKE_OFF})
    assert [mode for mode, _ in seen[3:]] == [TeamMode.FAILSAFE, TeamMode.STOPPED]
    assert seen[3][1].startswith("follower_2 is in failsafe: ")
    assert seen[4][1].startswith("follower_2 is stopped")


def test_vehicles_follow_the_team() -> None:
    """While the team is idle the motors are off; while it flies, all vehicles fly."""
    director = FlightDirector(field(seed=7).config)
    seen: list[tuple[TeamMode, frozenset[VehicleMode]]] = []
    for step in simulate(field(seed=7), director):
        if step.status is not None and len(step.status.vehicle_modes) == 3:
            seen.append((step.status.mode, frozenset(step.status.vehicle_modes.values())))
    for (_, _), (mode, vehicles) in itertools.pairwise(seen):
        if mode is TeamMode.FLYING:
            assert vehicles == {VehicleMode.FLYING}
