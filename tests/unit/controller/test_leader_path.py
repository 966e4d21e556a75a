"""Paths of the leader that begin in flight: to a place, to rest, and along the phases of a scenario."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from relform_controller.reference.leader_path import LeaderState, PhasesPath, Transfer
from relform_controller.reference.trajectory import LeaderReference, LeaderTrajectory
from relform_core.controller_config import LeaderMotionConfig
from support.scenarios import paper_scenario

LIMITS = LeaderMotionConfig(speed_max_m_s=1.5, acceleration_max_m_s2=2.0, turn_rate_max_deg_s=90.0)
STEP = 1e-2


def sampled(path: Transfer | PhasesPath) -> tuple[np.ndarray, LeaderReference]:
    times = np.arange(0.0, path.duration + 0.5, STEP)
    return times, path.at(times)


def check_consistent(found: LeaderReference, path: Transfer | PhasesPath) -> None:
    """The velocity is the derivative of the position."""
    middle = 0.5 * (found.v_NB_N[1:] + found.v_NB_N[:-1])
    assert np.diff(found.p_NB_N, axis=0) / STEP == pytest.approx(middle, abs=5e-3)


def test_transfer_from_rest() -> None:
    start = LeaderState.at_rest(np.array([1.0, -2.0, 1.5]), 0.5)
    path = Transfer(start, np.array([4.0, 2.0, 1.5]), 0.5, LIMITS)
    assert path.duration == pytest.approx(5.0)  # 5 m at a mean of two thirds of 1.5 m/s
    half = path.at(np.array([2.5]))
    assert half.p_NB_N[0] == pytest.approx([2.5, 0.0, 1.5])
    assert half.v_NB_N[0] == pytest.approx([0.9, 1.2, 0.0])
    assert path.at(np.array([9.0])).p_NB_N[0] == pytest.approx([4.0, 2.0, 1.5])


def test_transfer_turns_the_short_way() -> None:
    start = LeaderState.at_rest(np.zeros(3), math.radians(350.0))
    path = Transfer(start, np.zeros(3), math.radians(20.0), LIMITS)
    yaw = path.at(np.array([0.0, path.duration])).yaw_NB
    assert yaw == pytest.approx(np.radians([350.0, 380.0]))


@given(
    velocity=st.tuples(*(3 * [st.floats(-1.4, 1.4)])),
    place=st.tuples(*(3 * [st.floats(-20.0, 20.0)])),
    yaw=st.floats(-4.0, 4.0),
)
def test_transfer_keeps_its_limits(velocity: tuple[float, ...], place: tuple[float, ...], yaw: float) -> None:
    start = LeaderState(np.array([0.5, -1.0, 2.0]), np.array(velocity), 0.7)
    path = Transfer(start, np.array(place), yaw, LIMITS)
    times, found = sampled(path)
    assert found.p_NB_N[0] == pytest.approx(start.p_NB_N)
    assert found.v_NB_N[0] == pytest.approx(start.v_NB_N, abs=1e-9)
    assert found.p_NB_N[-1] == pytest.approx(np.array(place), abs=1e-9)
    assert found.v_NB_N[-1] == pytest.approx(np.zeros(3))
    fastest = max(LIMITS.speed_max, float(np.linalg.norm(velocity)))
    assert np.linalg.norm(found.v_NB_N, axis=1).max() <= fastest * 1.01
    inside = times[1:] < path.duration - STEP
    acceleration = np.linalg.norm(np.diff(found.v_NB_N, axis=0), axis=1)[inside] / STEP
    assert acceleration.max(initial=0.0) <= LIMITS.acceleration_max * 1.01
    assert np.abs(np.diff(found.yaw_NB)).max() <= LIMITS.turn_rate_max * STEP * 1.01
    check_consistent(found, path)


def test_braking_goes_straight_and_does_not_turn_back() -> None:
    start = LeaderState(np.array([1.0, 2.0, 3.0]), np.array([1.2, -0.5, 0.3]), 0.4)
    _, found = sampled(Transfer.to_rest(start, LIMITS))
    along = start.v_NB_N / np.linalg.norm(start.v_NB_N)
    way = found.p_NB_N - start.p_NB_N
    assert (np.diff(way @ along) >= -1e-12).all()
    assert way - np.outer(way @ along, along) == pytest.approx(np.zeros_like(way), abs=1e-12)
    assert found.yaw_NB == pytest.approx(np.full(len(way), 0.4))


def test_phases_are_flown_from_where_the_leader_is() -> None:
    config = paper_scenario().config
    start = LeaderState.at_rest(np.array([5.0, -3.0, 1.2]), config.start.yaw + math.pi / 2)
    trajectory = LeaderTrajectory(config, 15)
    path = PhasesPath(config, trajectory, start)
    times = np.array([0.0, 3.25, 8.0, 20.5])
    found, flown = path.at(times), trajectory.at(np.rint(times * 1e9).astype(np.int64))
    x, y, z = (flown.p_NB_N - np.array(config.start.position)).T
    assert found.p_NB_N == pytest.approx(start.p_NB_N + np.stack([-y, x, z], axis=1))
    v_x, v_y, v_z = flown.v_NB_N.T
    assert found.v_NB_N == pytest.approx(np.stack([-v_y, v_x, v_z], axis=1))
    assert found.yaw_NB == pytest.approx(flown.yaw_NB + math.pi / 2)
