"""Vehicles that would collide evade each other on board, and the controller says so."""

import numpy as np
import pytest

from relform_analysis.flight.log import FlightLog
from relform_analysis.flight.metrics import separation_min
from relform_analysis.flight.simulate import fly_in_process
from relform_core.load import load_scenario

UNCHECKED = (
    "controller.constraints={}",
    "controller.formation_change=null",
    "controller.formation_ramp_s=2.0",
)
"""Vehicles change sides on straight lines, which meet in the middle; nothing keeps them apart."""
GUSTS = (
    "controller=retuned",
    "controller.constraints={}",
    "events.0.force_n=[0.0, 2.5, 0.0]",
    "events.1.force_n=[0.0, -2.5, 0.0]",
)
"""They blow followers towards each other; the controller does not estimate wind."""
SEEDS = range(100, 106)


def fly(scenario: str, seed: int, *overrides: str) -> FlightLog:
    return fly_in_process(load_scenario(scenario, overrides, seed))


def n_collided(logs: list[FlightLog]) -> int:
    return sum("collided" in log.faults[0].description for log in logs if log.faults)


@pytest.mark.parametrize(("controller", "least"), [("team", 0.64), ("retuned", 0.58)])
def test_vehicles_whose_ways_meet_evade(controller: str, least: float) -> None:
    overrides = (f"controller={controller}", *UNCHECKED)
    assert n_collided([fly("crossing", seed, *overrides) for seed in SEEDS[:3]]) == 3
    for seed in SEEDS:
        log = fly("crossing", seed, *overrides, "separation={}")
        assert log.faults == (), seed
        assert separation_min(log.p_NB_N) > least, seed


def test_vehicles_that_gusts_drive_together_evade() -> None:
    assert n_collided([fly("gust", seed, *GUSTS) for seed in SEEDS]) >= 3
    logs = [fly("gust", seed, *GUSTS, "separation={}") for seed in SEEDS]
    assert sum(bool(log.faults) for log in logs) <= 1
    assert np.median([separation_min(log.p_NB_N) for log in logs]) > 0.57
    for log in logs:
        assert {alarm.source for alarm in log.alarms} == {"separation"}
        assert log.alarms[0].description.startswith("follower_1 and follower_2 are 0.")


def test_vehicles_far_apart_fly_as_without_it() -> None:
    calm = ("controller=team", "controller.constraints={}", "events=[]")
    plain, watched = fly("gust", 3, *calm), fly("gust", 3, *calm, "separation={}")
    assert separation_min(plain.p_NB_N) > 0.9
    np.testing.assert_allclose(watched.p_NB_N, plain.p_NB_N, atol=1e-9)
    assert watched.alarms == ()
