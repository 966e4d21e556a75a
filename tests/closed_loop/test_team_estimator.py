"""Flights with the team estimator: accuracy against the ground truth, and calm when things go wrong."""

import numpy as np
import pytest

from relform_analysis.flight.log import FlightLog
from relform_analysis.flight.metrics import flight_metrics
from relform_analysis.flight.simulate import fly_in_process
from support.scenarios import paper_scenario

TEAM = "controller=team"
LATE = "start_s: 8.0, end_s: 27.0"


def fly(*overrides: str, seed: int) -> FlightLog:
    return fly_in_process(paper_scenario(TEAM, *overrides, seed=seed))


def events(*listed: str) -> str:
    return f"events=[{', '.join(f'{{{event}}}' for event in listed)}]"


def wind(target: str) -> str:
    """0.5 N."""
    return f"kind: wind, target: {target}, {LATE}, force_n: [0.35, 0.35, 0.0]"


THRUST_LOSS = f"kind: thrust_scale, target: follower_1, {LATE}, scale: 0.9"
OUTLIERS = (
    "kind: outliers, target: follower_1, start_s: 0.5, end_s: 27.0, probability: 0.2, "
    "range_std_m: 1.0, bearing_std_deg: 57.3"
)
NO_LOCALIZATION = (
    "kind: dropout, target: leader, sensor: localization, start_s: 12.0, end_s: 17.0, probability: 1.0"
)

JUMP = "kind: localization_jump, target: leader, start_s: 12.0, end_s: 27.0, offset_m: [0.3, -0.4, 0.0]"
BLIND = (
    "kind: dropout, target: follower_1, sensor: range_bearing, start_s: 12.0, end_s: 13.0, probability: 1.0"
)
HIDDEN = tuple(
    f"kind: occlusion, target: {one}, hidden: {other}, start_s: 5.0, end_s: 27.0"
    for one, other in (("leader", "follower_2"), ("follower_2", "leader"))
)
NO_IMU = "kind: dropout, target: follower_1, sensor: imu, start_s: 12.0, end_s: 17.0, probability: 1.0"


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_papers_flight(seed: int) -> None:
    log = fly(seed=seed)
    score, rotors = flight_metrics(log).score, flight_metrics(log).rotors
    assert not log.faults
    assert score.formation.steady.mean < 0.009  # raw feedback: 0.065
    assert score.formation.steady.p95 < 0.018
    assert score.leader_position.steady.mean < 0.03
    assert rotors.std < np.pi / 30.0 * 210.0  # [rad/s]; raw feedback: 618 rpm


@pytest.mark.parametrize(
    ("change", "bound"),
    [
        (events(THRUST_LOSS), 0.013),
        (events(*map(wind, ("leader", "follower_1", "follower_2"))), 0.013),
        (events(OUTLIERS), 0.012),
        (events(NO_LOCALIZATION, wind("follower_2")), 0.013),
        (events(JUMP), 0.010),
        (events(NO_IMU), 0.014),
        (events(BLIND), 0.011),
        (events(*HIDDEN), 0.014),
        ("sensors.range_bearing.dropout_probability=0.5", 0.015),
    ],
    ids=[
        "thrust_loss",
        "wind_on_all",
        "outliers",
        "no_localization_and_wind",
        "localization_jump",
        "no_imu",
        "a_follower_sees_nothing_for_one_second",
        "leader_and_a_follower_no_longer_see_each_other",
        "half_of_all_sightings",
    ],
)
def test_disturbed_flights(change: str, bound: float) -> None:
    log = fly(change, seed=4)
    assert not log.faults
    assert flight_metrics(log).score.formation.steady.mean < bound
