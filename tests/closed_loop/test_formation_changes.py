"""Changes of formation by documented means are flown: by phases of a scenario, and by requests in flight."""

import math
from collections.abc import Mapping

import numpy as np
import pytest

from relform_analysis.flight.log import FlightLog
from relform_analysis.flight.metrics import separation_min, tilts
from relform_analysis.flight.simulate import fly_in_process, simulate
from relform_analysis.flight.tracking_errors import formation_errors, scored_pairs
from relform_controller.formation_controller import FormationController
from relform_core.load import LoadedScenario
from relform_core.schema import Vector3
from support.formations import as_yaml, line_astern, vee
from support.scenarios import paper_scenario

GUST = "events=[{kind: wind, start_s: 2.5, end_s: 3.5, target: follower_2, force_n: [0.0, 1.0, 0.0]}]"


def vee_to_line(n_vehicles: int, change_s: float, seed: int, motion: str) -> LoadedScenario:
    """A V becomes a line; the last follower flies several metres, in a gust of 1 N on follower_2."""
    followers = ", ".join(vee(n_vehicles))
    phases = ", ".join(
        f"{{name: {name}, title: {formation}, duration_s: {duration}, steady_from_s: 0.0, "
        f"formation: {formation}, motion: {motion}}}"
        for name, formation, duration in (("A", "vee", 2.0), ("B", "line", change_s))
    )
    return paper_scenario(
        f"team.followers=[{followers}]",
        f"formations_m={{vee: {as_yaml(vee(n_vehicles))}, line: {as_yaml(line_astern(n_vehicles))}}}",
        "start.position_m=[0, 0, 5]",
        f"phases=[{phases}]",
        GUST,
        seed=seed,
    )


def last_errors(log: FlightLog) -> float:
    """Mean formation error of the last half second [m]."""
    return float(formation_errors(log, scored_pairs(log.scenario.config.team))[-10:].mean())


HOVER, STRAIGHT = "{kind: hover, ramp_s: 0}", "{kind: straight, speed_m_s: 2, ramp_s: 1.5}"


@pytest.mark.parametrize(
    ("n_vehicles", "change_s", "seed", "motion"),
    [
        (3, 5.0, 0, HOVER),
        (3, 5.0, 1, STRAIGHT),
        (5, 9.0, 0, HOVER),
        (5, 9.0, 1, STRAIGHT),
        (8, 12.0, 0, STRAIGHT),
    ],
)
def test_a_vee_becomes_a_line(n_vehicles: int, change_s: float, seed: int, motion: str) -> None:
    log = fly_in_process(vee_to_line(n_vehicles, change_s, seed, motion))
    assert not log.faults
    assert math.degrees(tilts(log.q_NB).max()) < 35.0  # noise alone: 21
    assert separation_min(log.p_NB_N) > 0.9
    assert last_errors(log) < 0.12


HOVER_AT_6_M = (
    "start.position_m=[0, 0, 6]",
    "phases=[{name: A, title: hover, duration_s: 14, steady_from_s: 0, formation: initial, "
    "motion: {kind: hover, ramp_s: 0}}]",
)
AWAY: dict[str, Vector3] = {"follower_1": (-3.0, -3.0, -4.0), "follower_2": (-1.0, 0.5, -0.5)}
HOME: dict[str, Vector3] = {"follower_1": (-1.0, -0.5, -0.5), "follower_2": (-1.0, 0.5, -0.5)}


def fly_requests(
    requests: Mapping[int, Mapping[str, Vector3]], seed: int, *overrides: str
) -> dict[str, np.ndarray]:
    """Places of the followers relative to the leader at the end; requests by control step."""
    scenario = paper_scenario(*HOVER_AT_6_M, *overrides, seed=seed)
    controller = FormationController(scenario.config)
    step = None
    for number, step in enumerate(simulate(scenario, controller=controller)):
        assert not step.faults, step.faults
        places = np.array([truth.p_NB_N for truth in step.ground_truth.values()])
        assert separation_min(places[None]) > 0.55
        if number in requests:
            controller.set_formation(requests[number])
    assert step is not None
    leader = step.ground_truth["leader"].p_NB_N
    return {name: step.ground_truth[name].p_NB_N - leader for name in ("follower_1", "follower_2")}


@pytest.mark.parametrize("seed", range(3))
def test_a_request_of_several_metres_is_flown(seed: int) -> None:
    places = fly_requests({20: AWAY}, seed)
    for name, place in places.items():
        np.testing.assert_allclose(place, AWAY[name], atol=0.3)


@pytest.mark.parametrize("seed", range(3))
def test_requests_to_and_fro_during_a_change_are_flown(seed: int) -> None:
    requests = {step: AWAY if step % 40 else HOME for step in range(20, 160, 20)}
    places = fly_requests(requests, seed)
    last = requests[max(requests)]
    for name, place in places.items():
        np.testing.assert_allclose(place, last[name], atol=0.3)


@pytest.mark.parametrize(("seed", "controller"), [(0, "team"), (1, "team"), (0, "retuned")])
def test_two_followers_change_places(seed: int, controller: str) -> None:
    """And back; and forth again, before they have arrived."""
    swapped = {"follower_1": HOME["follower_2"], "follower_2": HOME["follower_1"]}
    places = fly_requests({20: swapped, 120: HOME, 150: swapped}, seed, f"controller={controller}")
    for name, place in places.items():
        np.testing.assert_allclose(place, swapped[name], atol=0.3)


@pytest.mark.parametrize("seed", range(2))
def test_three_of_four_followers_change_places_in_a_cycle(seed: int) -> None:
    """As phases of a scenario; with the team estimator, on a straight line."""
    first: dict[str, Vector3] = {
        "follower_1": (-0.8, -0.5, -0.2),
        "follower_2": (-1.5, 0.0, 0.1),
        "follower_3": (-0.8, 0.5, 0.0),
        "follower_4": (-2.3, 0.4, 0.3),
    }
    order = ("follower_2", "follower_3", "follower_1", "follower_4")
    then = {name: first[other] for name, other in zip(first, order, strict=True)}
    phases = ", ".join(
        f"{{name: {name}, title: {name}, duration_s: {duration}, steady_from_s: 0.0, formation: {formation}, "
        f"motion: {STRAIGHT}}}"
        for name, formation, duration in (("A", "first", 2.0), ("B", "then", 5.0))
    )
    log = fly_in_process(
        paper_scenario(
            "controller=team",
            f"team.followers=[{', '.join(first)}]",
            f"formations_m={{first: {as_yaml(first)}, then: {as_yaml(then)}}}",
            f"phases=[{phases}]",
            seed=seed,
        )
    )
    assert not log.faults
    assert separation_min(log.p_NB_N) > 0.55
    assert last_errors(log) < 0.03
