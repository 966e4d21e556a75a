"""Relative yaw against truth, over random attitudes and baselines; truth is built with SciPy."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from relform_controller.estimation.relative_yaw import YawEstimate, relative_position_B, yaw_from_mutual_sight
from relform_controller.ocp.frames import rotation_CB
from support.world import TrueVehicle, sight

yaws = st.floats(-math.pi, math.pi)
tilts = st.floats(-math.radians(60.0), math.radians(60.0))
attitudes = st.tuples(yaws, tilts, tilts)


@st.composite
def baselines(draw: st.DrawFn) -> np.ndarray:
    """From vehicle 1 to vehicle 2 in the world, not vertical."""
    heading, horizontal, up = draw(yaws), draw(st.floats(0.2, 8.0)), draw(st.floats(-2.0, 2.0))
    return np.array([horizontal * math.cos(heading), horizontal * math.sin(heading), up])


def vehicle(p_NB_N: np.ndarray, attitude: tuple[float, float, float]) -> TrueVehicle:
    return TrueVehicle(p_NB_N, Rotation.from_euler("ZYX", attitude), np.zeros(3), np.zeros(3))


def estimate(first: TrueVehicle, second: TrueVehicle) -> YawEstimate:
    """As the controller does: roll and pitch are known, the yaws are not."""
    _, pitch_1, roll_1 = first.attitude.as_euler("ZYX")
    _, pitch_2, roll_2 = second.attitude.as_euler("ZYX")
    return yaw_from_mutual_sight(
        sight(first, second, "b"),
        rotation_CB(roll_1, pitch_1),
        sight(second, first, "a"),
        rotation_CB(roll_2, pitch_2),
    )


def same_angle(a: float, b: float) -> bool:
    return abs((a - b + math.pi) % (2 * math.pi) - math.pi) < 1e-7


@given(attitude_1=attitudes, attitude_2=attitudes, baseline=baselines())
def test_yaw_of_the_second_relative_to_the_first(
    attitude_1: tuple[float, float, float], attitude_2: tuple[float, float, float], baseline: np.ndarray
) -> None:
    first = vehicle(np.array([3.0, -7.0, 2.0]), attitude_1)
    second = vehicle(first.p_NB_N + baseline, attitude_2)
    found = estimate(first, second)
    assert same_angle(found.yaw, attitude_2[0] - attitude_1[0])
    assert -math.pi <= found.yaw <= math.pi
    # R_I1I2 turns what 2 sees, levelled, into what 1 sees, levelled: opposite displacements.
    p_2 = rotation_CB(attitude_2[2], attitude_2[1]) @ relative_position_B(sight(second, first, "a"))
    p_1 = rotation_CB(attitude_1[2], attitude_1[1]) @ relative_position_B(sight(first, second, "b"))
    np.testing.assert_allclose(Rotation.from_euler("z", found.yaw).apply(p_2), -p_1, atol=1e-6)


@given(attitude_1=attitudes, attitude_2=attitudes, baseline=baselines())
def test_exchanged_vehicles_have_the_negative_yaw(
    attitude_1: tuple[float, float, float], attitude_2: tuple[float, float, float], baseline: np.ndarray
) -> None:
    first, second = vehicle(np.zeros(3), attitude_1), vehicle(baseline, attitude_2)
    there, back = estimate(first, second), estimate(second, first)
    assert same_angle(there.yaw, -back.yaw)
    assert there.variance == pytest.approx(back.variance, rel=1e-9)


@given(attitude_1=attitudes, attitude_2=attitudes, baseline=baselines(), turn=yaws)
def test_the_relative_yaw_does_not_depend_on_the_world_frame(
    attitude_1: tuple[float, float, float],
    attitude_2: tuple[float, float, float],
    baseline: np.ndarray,
    turn: float,
) -> None:
    first, second = vehicle(np.zeros(3), attitude_1), vehicle(baseline, attitude_2)
    world = Rotation.from_euler("z", turn)
    turned = [
        TrueVehicle(world.apply(v.p_NB_N), world * v.attitude, np.zeros(3), np.zeros(3))
        for v in (first, second)
    ]
    assert same_angle(estimate(*turned).yaw, estimate(first, second).yaw)
