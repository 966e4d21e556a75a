"""Rotors that get weaker: the team flies on as long as it can, and a vehicle that can not lands by itself."""

import numpy as np
import pytest

from relform_analysis.flight.log import FlightLog
from relform_analysis.flight.simulate import fly_in_process
from relform_analysis.flight.tracking_errors import formation_errors, scored_pairs
from relform_core.load import load_scenario


def fly(scenario: str, seed: int, *overrides: str) -> FlightLog:
    return fly_in_process(load_scenario(scenario, overrides, seed))


def mean_error(log: FlightLog, since: float) -> float:
    """Of the formation, from a time on [m]."""
    errors = formation_errors(log, scored_pairs(log.scenario.config.team))
    return float(np.nanmean(errors[log.step_ns * 1e-9 > since]))


@pytest.mark.parametrize(
    ("event", "most"),
    [
        ("kind: thrust_decay, rate_percent_s: 5, floor_percent: 60", 0.022),
        ("kind: weak_rotor, rotor: left, scale: 0.9", 0.06),
        ("kind: weak_rotor, rotor: front, scale: 0.85", 0.09),
    ],
)
def test_the_team_flies_on(event: str, most: float) -> None:
    acts = f"events=[{{target: follower_1, start_s: 2.0, end_s: 60.0, {event}}}]"
    log = fly("paper", 1, "controller=team", acts)
    assert log.faults == ()
    assert mean_error(log, since=8.0) < most


DECAY = (
    "phases.0.duration_s=14.0",
    "ground={time_s: 30.0, interval_s: 0.5}",
    "events=[{kind: thrust_decay, target: follower_1, start_s: 0.5, end_s: 90.0, rate_percent_s: 3.0}]",
)
"""To half of the thrust while the team flies straight on; the vehicle needs 52 % to hover."""


def test_a_vehicle_without_enough_thrust_lands_by_itself_and_the_team_with_it() -> None:
    crashed = fly("gust", 5, *DECAY)
    assert crashed.faults[0].source == "follower_1"
    assert "the ground" in crashed.faults[0].description
    for seed in (5, 6):
        landed = fly("gust", seed, *DECAY, "vehicle.thrust_min_percent=70")
        assert landed.faults == ()
        assert landed.p_NB_N[-1, :, 2].max() < 0.11
        *_, failsafe, end = [entry.description for entry in landed.changes]
        assert failsafe == "failsafe: follower_1 is in failsafe: its thrust is too weak to fly on"
        assert end.startswith(("idle", "stopped"))


def test_whole_rotors_fly_as_without_watching_them() -> None:
    short = "ground.time_s=12.0"
    plain, watched = fly("field", 2, short), fly("field", 2, short, "vehicle.thrust_min_percent=70")
    np.testing.assert_array_equal(plain.p_NB_N, watched.p_NB_N)
