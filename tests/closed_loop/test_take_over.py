"""A controller is lost in flight: vehicles land by themselves, and a new controller takes the team over."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import pytest

from relform_controller.blas import one_blas_thread
from relform_controller.flight_director import FlightDirector
from relform_controller.team_controller import make_controller
from relform_core.errors import FlightError
from relform_core.flight_modes import TeamMode, TeamRequest, VehicleMode
from relform_core.load import LoadedScenario
from relform_core.measurements import Odometry, TeamMeasurements
from relform_core.sensors.flight_status import FLIGHT_STATUS
from relform_core.telemetry import Decision, RequestMade, Standby, TeamStatus
from relform_sim.team import SimulatedTeam
from support.scenarios import FROM_GROUND, paper_scenario

NEVER = 1e9
M = VehicleMode


@dataclass
class Flight:
    """What happened, by control step."""

    scenario: LoadedScenario
    truth: list[dict[str, Odometry]] = field(default_factory=list)
    measured: list[TeamMeasurements] = field(default_factory=list)
    outcomes: list[Decision | Standby | None] = field(default_factory=list)
    """None: there was no controller."""
    statuses: list[TeamStatus | None] = field(default_factory=list)

    def step(self, time: float) -> int:
        return round(time / self.scenario.config.controller.period)

    def modes(self, step: int) -> list[VehicleMode]:
        """What the vehicles say that they do."""
        reports = [each.newest(FLIGHT_STATUS) for each in self.measured[step].by_vehicle.values()]
        assert None not in reports
        return [report.mode for report in reports if report is not None]

    def team_modes(self, since: float) -> list[TeamMode]:
        """One after the other, without repetition."""
        modes = [status.mode for status in self.statuses[self.step(since) :] if status is not None]
        return [mode for before, mode in zip([None, *modes], modes, strict=False) if mode is not before]


def fly(
    overrides: Sequence[str],
    lost_at: float,
    back_at: float,
    duration: float = NEVER,
    seed: int = 0,
    take_off_at: float = NEVER,
    *,
    is_new: bool = True,
) -> Flight:
    """Fly without a controller between two instants, and then with a new one or, after a stop, the same one.

    A fault fails the test.
    """
    scenario = paper_scenario("controller=team", "pacing=real_time", *overrides, seed=seed)
    config = scenario.config
    flight = Flight(scenario)
    team, controller = SimulatedTeam(config, seed), make_controller(config)
    measurements = team.step()
    with one_blas_thread():
        for step in range(min(config.n_steps, flight.step(duration))):
            outcome = None
            if step == flight.step(back_at) and is_new:
                controller = make_controller(config)
                controller.resume()
            if step == flight.step(take_off_at) and isinstance(controller, FlightDirector):
                controller.request(RequestMade(TeamRequest.TAKE_OFF))
            if not flight.step(lost_at) <= step < flight.step(back_at):
                outcome = controller.step(measurements)
            flight.truth.append(dict(team.ground_truth))
            flight.measured.append(measurements)
            flight.outcomes.append(outcome)
            is_directed = outcome is not None and isinstance(controller, FlightDirector)
            flight.statuses.append(controller.status if is_directed else None)  # type: ignore[union-attr]
            measurements = team.step({} if outcome is None else outcome.commands)
            assert not team.faults, team.faults
    return flight


@pytest.mark.parametrize(
    ("lost_at", "back_at", "recovery"),
    [
        pytest.param(0.6, 2.6, 4.0, id="hover"),
        pytest.param(4.0, 6.0, 4.0, id="straight on at 2 m/s, back as the team should turn"),
        # Each vehicle flies on in its own direction; the followers come back from 7 m away at 1 m/s at most.
        pytest.param(6.0, 8.2, 18.5, id="as the team begins to turn"),
        pytest.param(10.5, 12.7, 4.0, id="back when another formation is to be flown"),
        pytest.param(20.0, 22.2, 4.0, id="spiral"),
    ],
)
@pytest.mark.parametrize("seed", [1, 2])
def test_a_new_controller_goes_on_with_the_present_phase(
    lost_at: float, back_at: float, recovery: float, seed: int
) -> None:
    """``recovery``: time in which the team must be where it should be again [s]."""
    flight = fly((), lost_at, back_at, duration=back_at + recovery + 1.0, seed=seed)
    config = flight.scenario.config
    back = flight.step(back_at)
    assert set(flight.modes(back)) == {M.FAILSAFE}
    decided = flight.outcomes[back:]
    assert all(isinstance(outcome, Decision) for outcome in decided), "it decides from its first step on"
    assert set(flight.modes(back + 2)) == {M.FLYING}
    recovered = flight.step(back_at + recovery)
    for step, outcome in list(enumerate(flight.outcomes))[recovered:]:
        assert isinstance(outcome, Decision)
        assert outcome.reference.phase == config.phase_at(step).name
        assert outcome.state.leader_position_error < 0.25
        truth = flight.truth[step]
        for pair in outcome.state.pairs:
            if pair.observer == "leader":
                assert np.linalg.norm(pair.p_B1B2_C1__est - pair.p_B1B2_C1__ref) < 0.25
                apart = truth[pair.target].p_NB_N - truth["leader"].p_NB_N
                assert np.linalg.norm(apart) == pytest.approx(np.linalg.norm(pair.p_B1B2_C1__ref), abs=0.25)


@pytest.mark.parametrize("lost_at", [2.0, 12.0])
def test_without_a_controller_the_vehicles_finish_their_plan_brake_land_and_disarm(lost_at: float) -> None:
    flight = fly((), lost_at, NEVER, duration=lost_at + 12.0, seed=3)
    config = flight.scenario.config
    failsafe, lost = config.vehicle.failsafe, flight.step(lost_at)
    horizon = flight.step(config.controller.horizon)
    assert set(flight.modes(lost + horizon - 1)) == {M.FLYING}, "they fly their plan"
    assert set(flight.modes(lost + horizon + 2)) == {M.FAILSAFE}
    highest = max(truth.p_NB_N[2] for truth in flight.truth[lost].values())
    landed = flight.step(lost_at + config.controller.horizon + highest / failsafe.descent_speed + 3.0)
    assert set(flight.modes(landed)) == {M.STOPPED}
    for truth in flight.truth[landed].values():
        assert truth.p_NB_N[2] == pytest.approx(config.vehicle.leg_height, abs=0.01)
        assert np.linalg.norm(truth.v_NB_B) < 0.01


def test_a_team_of_which_one_has_landed_is_not_taken_over() -> None:
    with pytest.raises(
        FlightError, match=r"^the team cannot be taken over: leader is on the ground \(stopped\)$"
    ):
        fly((), 2.0, 13.0)


def test_vehicles_that_are_about_to_land_are_left_to_land() -> None:
    with pytest.raises(FlightError, match=r"follower_1 sinks, 0.3\d m above the ground \(at least 0.4 m"):
        fly((), 2.0, 6.9)


FLIES_AT_S = 12.0
"""From the ground: take-off takes 8 s."""


def test_a_team_that_flies_by_requests_is_taken_over_and_hovers() -> None:
    flight = fly(
        (FROM_GROUND, "ground.waits=true", "ground.time_s=30"), FLIES_AT_S, 14.2, take_off_at=1.0, seed=2
    )
    assert flight.team_modes(14.2) == [TeamMode.TAKING_OVER, TeamMode.HOVERING]
    last = flight.outcomes[-1]
    assert isinstance(last, Decision)
    assert last.state.leader_position_error < 0.1
    before, after = flight.truth[flight.step(FLIES_AT_S)], flight.truth[-1]
    for name in before:
        assert np.linalg.norm(after[name].p_NB_N - before[name].p_NB_N) < 1.0  # it has sunk a little


def test_a_team_on_the_ground_stays_there() -> None:
    flight = fly((FROM_GROUND, "ground.waits=true", "ground.time_s=2"), 0.5, 1.0)
    assert flight.team_modes(1.0) == [TeamMode.IDLE]


@pytest.mark.parametrize(
    ("lost_at", "back_at", "modes"),
    [
        pytest.param(3.0, 5.0, [TeamMode.TAKING_OVER, TeamMode.HOVERING, TeamMode.LANDING, TeamMode.IDLE]),
        pytest.param(
            FLIES_AT_S, 14.2, [TeamMode.TAKING_OVER, TeamMode.HOVERING, TeamMode.LANDING, TeamMode.IDLE]
        ),
        pytest.param(FLIES_AT_S, 24.0, [TeamMode.STOPPED], id="landed by the failsafe"),
    ],
)
def test_a_directed_team_is_taken_over(lost_at: float, back_at: float, modes: list[TeamMode]) -> None:
    flight = fly((FROM_GROUND, "ground.time_s=30"), lost_at, back_at, seed=1)
    assert flight.team_modes(back_at) == modes
    for truth in flight.truth[-1].values():
        assert truth.p_NB_N[2] < flight.scenario.config.vehicle.leg_height + 0.01


def test_a_team_that_is_partly_on_the_ground_lands() -> None:
    """The first vehicle has just left the ground."""
    flight = fly((FROM_GROUND, "ground.time_s=8"), 0.3, 1.5)
    assert flight.team_modes(1.5) == [TeamMode.FAILSAFE, TeamMode.IDLE]
    status = flight.statuses[flight.step(1.6)]
    assert status is not None
    assert status.reason == "not taken over: follower_1 is on the ground (armed)"


@pytest.mark.parametrize(("stopped_at", "on_at"), [(2.0, 3.1), (4.0, 7.0), (6.0, 7.8)])
def test_a_controller_that_was_stopped_takes_the_team_over_again(stopped_at: float, on_at: float) -> None:
    flight = fly((), stopped_at, on_at, seed=1, is_new=False)
    last = flight.outcomes[-1]
    assert isinstance(last, Decision)
    assert last.state.leader_position_error < 0.1
    for pair in last.state.pairs:
        assert np.linalg.norm(pair.p_B1B2_C1__est - pair.p_B1B2_C1__ref) < 0.25


def test_a_flight_director_that_was_stopped_takes_the_team_over_again() -> None:
    flight = fly((FROM_GROUND, "ground.time_s=30"), FLIES_AT_S, 14.2, seed=1, is_new=False)
    assert flight.team_modes(14.2) == [
        TeamMode.TAKING_OVER,
        TeamMode.HOVERING,
        TeamMode.LANDING,
        TeamMode.IDLE,
    ]
