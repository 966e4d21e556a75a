"""Metrics against numbers worked out by hand."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from relform_analysis.flight.log_builder import FlightLogBuilder
from relform_analysis.flight.metrics import (
    Distribution,
    flight_metrics,
    separation_min,
    settling_time,
    steady_steps,
    tilts,
)
from relform_analysis.flight.tracking_errors import (
    follower_yaw_errors,
    formation_errors,
    leader_errors,
    relative_positions,
    scored_pairs,
    yaw_of,
)
from relform_core.units import rpm_to_rad_s
from support.logs import decision, odometry, perfect_builder
from support.scenarios import paper_scenario, team_of

PERIOD_NS = 50_000_000
L_F1, L_F2, F2_F1 = ("leader", "follower_1"), ("leader", "follower_2"), ("follower_2", "follower_1")

# The leader looks to the north-west of the paper's plane (+y), so that its formation lies at
# R_z(90 deg) (-1, -0.5, -0.5) = (0.5, -1, -0.5) and (-0.5, -1, -0.5) from it.
LEADER, LEADER_YAW = (1.0, 2.0, 3.0), 90.0
PLACE_1, PLACE_2 = (1.5, 1.0, 2.5), (0.5, 1.0, 2.5)


def one_step(place_1: Sequence[float], place_2: Sequence[float], yaw_2: float) -> FlightLogBuilder:
    builder = FlightLogBuilder(paper_scenario())
    builder.add_ground_truth("leader", odometry(0, LEADER, LEADER_YAW))
    builder.add_ground_truth("follower_1", odometry(0, place_1, -33.0))
    builder.add_ground_truth("follower_2", odometry(0, place_2, yaw_2))
    builder.add_decision(decision(0))
    return builder


def test_formation_at_its_place_has_no_error() -> None:
    log = one_step(PLACE_1, PLACE_2, yaw_2=LEADER_YAW).build()
    np.testing.assert_allclose(formation_errors(log, [L_F1, L_F2, F2_F1]), np.zeros((1, 3)), atol=1e-12)


def test_formation_error_is_in_the_observers_frame() -> None:
    # F1 is off by (0.03, 0.04, 0) in the world; F2 is at its place but looks 30 deg left of the leader:
    # it sees F1 at R_z(-120 deg) (1.03, 0.04, 0) = (-0.480359, -0.912006, 0) instead of (0, -1, 0).
    log = one_step((1.53, 1.04, 2.5), PLACE_2, yaw_2=120.0).build()
    errors = formation_errors(log, [L_F1, L_F2, F2_F1])
    np.testing.assert_allclose(errors, [[0.05, 0.0, math.hypot(0.480359, 0.087994)]], atol=1e-6)


def test_relative_positions_of_many_instants() -> None:
    positions = np.array([[[1.0, 2.0, 3.0], [2.0, 2.0, 2.0]], [[0.0, 0.0, 1.0], [0.0, -3.0, 1.0]]])
    yaws = np.radians([[90.0, 0.0], [-90.0, 45.0]])
    seen = relative_positions(positions, yaws)
    np.testing.assert_allclose(seen[0, 0, 1], [0.0, -1.0, -1.0], atol=1e-12)
    np.testing.assert_allclose(seen[0, 1, 0], [-1.0, 0.0, 1.0], atol=1e-12)
    np.testing.assert_allclose(seen[1, 0, 1], [3.0, 0.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(seen[1, 1, 0], [math.sqrt(4.5), math.sqrt(4.5), 0.0], atol=1e-12)


@pytest.mark.parametrize("yaw_deg", [-179.0, -90.0, 12.5, 135.0])
def test_yaw_of_a_tilted_vehicle(yaw_deg: float) -> None:
    q_NB = odometry(0, LEADER, yaw_deg, pitch_deg=35.0, roll_deg=-50.0).q_NB
    assert math.degrees(float(yaw_of(q_NB))) == pytest.approx(yaw_deg)


def test_leader_errors_and_wrapped_yaw() -> None:
    builder = FlightLogBuilder(paper_scenario())
    for vehicle, place in (("leader", (1.3, 1.6, 3.0)), ("follower_1", PLACE_1), ("follower_2", PLACE_2)):
        builder.add_ground_truth(vehicle, odometry(0, place, -175.0))
    builder.add_decision(decision(0, yaw_NB=math.radians(3.0 * 360.0 + 178.0)))  # references are continuous
    position_error, yaw_error = leader_errors(builder.build())
    assert position_error == pytest.approx([0.5])
    assert np.degrees(yaw_error) == pytest.approx([7.0])


def test_scored_pairs_are_the_papers_and_chain_followers() -> None:
    assert scored_pairs(paper_scenario().config.team) == (L_F1, L_F2, F2_F1)
    pairs = scored_pairs(paper_scenario(*team_of(5)).config.team)
    assert [pair for pair in pairs if pair[0] == "leader"] == [
        ("leader", f"follower_{i}") for i in range(1, 5)
    ]
    assert [pair for pair in pairs if pair[0] != "leader"] == [
        (f"follower_{i + 1}", f"follower_{i}") for i in range(1, 4)
    ]


def test_distribution() -> None:
    errors = np.array([[0.1, 0.2], [0.3, np.nan], [0.4, 0.5]])
    distribution = Distribution.of(errors)
    assert distribution.mean == pytest.approx(0.3)
    assert distribution.max == 0.5
    assert distribution.p95 == pytest.approx(0.48)  # 0.8 of the way from the 4th to the 5th of five values


def test_steady_windows_begin_on_their_instant() -> None:
    # A is steady from its start, B from 2.5 s on: its 51st step.
    log = perfect_builder(paper_scenario(), ["A"] * 20 + ["B"] * 60).build()
    assert steady_steps(log).tolist() == [True] * 20 + [False] * 50 + [True] * 10


def test_steady_windows_do_not_move_when_the_first_steps_of_a_phase_are_missing() -> None:
    log = perfect_builder(paper_scenario(), ["A"] * 20 + ["B"] * 60).build()
    lost = range(20, 25)
    gap = replace(log, tick_of_step=np.delete(log.tick_of_step, lost), phase=log.phase[:20] + log.phase[25:])
    np.testing.assert_array_equal(steady_steps(gap), np.delete(steady_steps(log), lost))


def test_steady_errors_are_those_of_the_windows() -> None:
    builder = perfect_builder(paper_scenario(), ["A"] * 20 + ["B"] * 60)
    log = builder.build()
    log.p_NB_N[20:70, 1] += [0.0, 0.3, 0.4]  # in B, but not steady
    log.p_NB_N[70:75, 1] += [0.0, 0.0, 0.2]  # half of the steady steps of B
    metrics = flight_metrics(log)
    phase_a, phase_b, *later = metrics.phases
    assert phase_a.score.formation.all.max == pytest.approx(0.0, abs=1e-12)
    assert phase_b.start == pytest.approx(1.0)
    assert phase_b.steps == 60
    assert phase_b.score.pairs[L_F1].all.mean == pytest.approx((50 * 0.5 + 5 * 0.2) / 60)
    assert phase_b.score.pairs[L_F1].steady.mean == pytest.approx(0.1)
    assert phase_b.score.pairs[L_F2].steady.max == pytest.approx(0.0, abs=1e-12)
    assert metrics.score.formation.steady.mean == pytest.approx(2 * 5 * 0.2 / (3 * 30))  # two pairs have F1
    assert metrics.score.formation.all.max == pytest.approx(0.5)
    assert [phase.steps for phase in later] == [0, 0, 0]
    assert all(math.isnan(phase.start) and math.isnan(phase.score.formation.all.mean) for phase in later)


def test_rotor_speeds_of_all_together() -> None:
    builder = perfect_builder(paper_scenario(), ["A"] * 2)
    for step in range(2):
        speeds = {"leader": [500.0] * 4, "follower_1": [400.0] * 4, "follower_2": [400.0, 500.0] * 2}
        builder.add_decision(decision(step * PERIOD_NS, speeds=speeds))
    rotors = flight_metrics(builder.build()).rotors
    assert (rotors.min, rotors.max, rotors.mean, rotors.std) == (400.0, 500.0, 450.0, 50.0)
    assert rotors.saturated_fraction == 0.0


def test_a_step_is_saturated_if_any_rotor_is_within_1_rpm_of_a_limit() -> None:
    low, high = rpm_to_rad_s(1200.0), rpm_to_rad_s(6000.0)
    last_rotor = [high - rpm_to_rad_s(0.9), high - rpm_to_rad_s(1.1), low, low + rpm_to_rad_s(1.1), 500.0]
    builder = perfect_builder(paper_scenario(), ["A"] * len(last_rotor))
    for step, speed in enumerate(last_rotor):
        speeds = {"follower_1": [500.0, 400.0, 500.0, speed]}
        builder.add_decision(decision(step * PERIOD_NS, speeds=speeds))
    assert flight_metrics(builder.build()).rotors.saturated_fraction == pytest.approx(2 / 5)


def test_separation_counts_every_instant_and_pair() -> None:
    positions = np.array(
        [[[0, 0, 0], [3, 0, 4], [0, 9, 0]], [[0, 0, 0], [3, 0, 4], [0, 0, 2.5]]], dtype=float
    )
    assert separation_min(positions) == pytest.approx(2.5)
    assert separation_min(positions[:1]) == pytest.approx(5.0)


def test_solver() -> None:
    builder = perfect_builder(paper_scenario(), ["A"] * 3)
    for step, (kkt, prepare, feedback, state) in enumerate(
        [(3.0, 0.010, 0.001, 1), (1.0, 0.020, 0.002, 2), (2.0, 0.030, 0.009, 0)]
    ):
        report = {"kkt": kkt, "prepare_time": prepare, "feedback_time": feedback, "state": state}
        builder.add_decision(decision(step * PERIOD_NS, **report))
    solver = flight_metrics(builder.build()).solver
    assert (solver.kkt_median, solver.kkt_first_median, solver.sqp_steps_median) == (2.0, 80.0, 2.0)
    assert (solver.prepare_time_median, solver.feedback_time_median) == (0.020, 0.002)
    assert (solver.step_time_median, solver.step_time_max) == pytest.approx((0.022, 0.039))
    assert solver.fallback_steps == 1
    assert solver.active_times == {}


def test_time_of_active_constraints() -> None:
    builder = perfect_builder(paper_scenario(), ["A"] * 4)
    for step, active in enumerate([(), ("tilt leader",), ("tilt leader", "speed leader"), ("tilt leader",)]):
        builder.add_decision(decision(step * PERIOD_NS, active_constraints=active))
    found = flight_metrics(builder.build()).solver.active_times
    assert found == pytest.approx({"tilt leader": 0.15, "speed leader": 0.05})


def test_no_flight_has_no_numbers() -> None:
    metrics = flight_metrics(FlightLogBuilder(paper_scenario()).build())
    assert metrics.steps == 0
    assert math.isnan(metrics.score.formation.all.mean)
    assert math.isnan(metrics.separation_min)
    assert math.isnan(metrics.rotors.saturated_fraction)
    assert math.isnan(metrics.solver.step_time_max)


def test_yaw_of_followers_is_relative_to_the_leader() -> None:
    log = one_step(PLACE_1, PLACE_2, yaw_2=-170.0).build()  # the leader at 90 deg, F1 at -33 deg
    np.testing.assert_allclose(np.degrees(follower_yaw_errors(log)), [[123.0, 100.0]], atol=1e-9)
    score = flight_metrics(log).score.follower_yaw
    assert math.degrees(score.all.mean) == pytest.approx(111.5)


def test_tilt_is_the_angle_of_body_z_to_the_vertical() -> None:
    angles = [(50.0, 0.0, 12.0), (-20.0, -31.0, 0.0), (170.0, 20.0, -35.0)]
    quaternions = np.array([odometry(0, (0.0, 0.0, 1.0), *each).q_NB for each in angles])
    both = math.degrees(math.acos(math.cos(math.radians(20.0)) * math.cos(math.radians(35.0))))
    np.testing.assert_allclose(np.degrees(tilts(quaternions)), [12.0, 31.0, both], atol=1e-9)
    np.testing.assert_allclose(np.degrees(tilts(-quaternions)), [12.0, 31.0, both], atol=1e-9)


@pytest.mark.parametrize(
    ("errors", "expected"),
    [
        ([0.9, 0.5, 0.2, 0.05, 0.1, 0.08], 0.15),  # the steady window never exceeds 0.1
        ([0.9, 0.05, 0.2, 0.05, 0.1, 0.08], 0.15),  # nor does what was small in between count
        ([0.1, 0.05, 0.02, 0.05, 0.1, 0.08], 0.0),
        ([0.9, 0.9, 0.9, 0.9, 0.1, 0.08], 0.2),
    ],
)
def test_settling_time(errors: list[float], expected: float) -> None:
    times = 11.0 + 0.05 * np.arange(6)
    steady = np.arange(6) >= 4
    assert settling_time(times, np.array(errors), steady) == pytest.approx(expected)
    assert np.isnan(settling_time(times, np.array(errors), np.zeros(6, dtype=bool)))


def test_an_error_that_is_larger_at_the_end_has_not_settled() -> None:
    steady = np.array([False, True, True, False])
    assert np.isnan(settling_time(np.arange(4) * 0.05, np.array([0.5, 0.1, 0.2, 0.3]), steady))
