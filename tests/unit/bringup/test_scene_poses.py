"""Poses in the world from what the controller estimates, by hand."""

import math

import numpy as np
import pytest

from relform_bringup.scene.poses import estimated_poses, tilt_of, wanted_places
from relform_core.arrays import Array
from relform_core.telemetry import LeaderEstimate, PairEstimate, TeamReference, TeamState


def pair(observer: str, target: str, position: tuple[float, float, float], yaw: float = 0.0) -> PairEstimate:
    return PairEstimate(observer, target, np.array(position), np.zeros(3), yaw, 0.01, False)


def state(leader: LeaderEstimate | None, *pairs: PairEstimate) -> TeamState:
    return TeamState("A", pairs, 0.0, 0.0, leader)


def about(axis: str, degrees: float) -> Array:
    half = math.radians(0.5 * degrees)
    vector = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}[axis]
    return np.array([*(math.sin(half) * each for each in vector), math.cos(half)])


LEADER_FACING_NORTH = LeaderEstimate(np.array([10.0, 20.0, 2.0]), math.radians(90.0), None)


def test_a_follower_is_placed_and_turned_from_the_leader() -> None:
    """1 m behind a leader that faces north is 1 m to the south; 2 m to its left is to the west."""
    seen = pair("leader", "wing", (-1.0, 2.0, -0.5), math.radians(-30.0))
    back = pair("wing", "leader", (9.0, 9.0, 9.0), math.radians(77.0))
    poses = estimated_poses(state(LEADER_FACING_NORTH, back, seen), {}, "leader")
    assert poses.keys() == {"leader", "wing"}
    assert poses["leader"].p_NB_N == pytest.approx([10.0, 20.0, 2.0])
    assert poses["leader"].q_NB == pytest.approx(about("z", 90.0))
    assert poses["wing"].p_NB_N == pytest.approx([8.0, 19.0, 1.5])
    assert poses["wing"].q_NB == pytest.approx(about("z", 60.0))


def test_roll_and_pitch_are_those_of_the_imu_and_its_yaw_is_not() -> None:
    """The yaw of a follower's IMU has an unknown offset."""
    nose_down = {"wing": about("y", 20.0)}
    seen = pair("leader", "wing", (-1.0, 2.0, -0.5), math.radians(-90.0))
    poses = estimated_poses(state(LEADER_FACING_NORTH, seen), nose_down, "leader")
    assert poses["leader"].q_NB == pytest.approx(about("z", 90.0))
    assert poses["wing"].q_NB == pytest.approx(about("y", 20.0))
    half = math.radians(10.0)
    turned_by_180_then_nose_down = np.array([-math.sin(half), 0.0, math.cos(half), 0.0])
    poses = estimated_poses(
        state(LEADER_FACING_NORTH, seen), {"wing": turned_by_180_then_nose_down}, "leader"
    )
    assert poses["wing"].q_NB == pytest.approx(about("y", 20.0))


def test_a_state_of_an_older_version_gives_no_poses() -> None:
    assert estimated_poses(state(None, pair("leader", "wing", (1.0, 0.0, 0.0))), {}, "leader") == {}


def test_places_of_the_formation_turn_with_the_reference_of_the_leader() -> None:
    formation = {
        ("wing", "leader"): np.array([7.0, 7.0, 7.0]),
        ("leader", "wing"): np.array([-1.0, 0.5, 0.25]),
    }
    reference = TeamReference("A", np.array([1.0, 2.0, 3.0]), np.zeros(3), math.radians(180.0), formation)
    places = wanted_places(reference, "leader")
    assert places.keys() == {"leader", "wing"}
    assert places["leader"].p_NB_N == pytest.approx([1.0, 2.0, 3.0])
    assert places["wing"].p_NB_N == pytest.approx([2.0, 1.5, 3.25])
    assert np.abs(places["wing"].q_NB) == pytest.approx([0.0, 0.0, 1.0, 0.0])


def test_the_tilt_of_a_level_attitude_is_none() -> None:
    assert tilt_of(about("z", 135.0)) == pytest.approx([0.0, 0.0, 0.0, 1.0])
