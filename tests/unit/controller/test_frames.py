"""Rotations, by numbers worked out by hand; the property tests compare them with SciPy."""

import math

import numpy as np
import pytest

from relform_controller.ocp.frames import (
    rotation_CB,
    rotation_x,
    rotation_y,
    rotation_z,
    rotations_z,
    rpy_from_quaternion,
    wrap_angle,
)

DEGREE = math.pi / 180.0
FORWARD, LEFT, UP = np.eye(3)


def test_a_positive_roll_lowers_the_right_side() -> None:
    np.testing.assert_allclose(rotation_x(30 * DEGREE) @ LEFT, [0, math.sqrt(3) / 2, 0.5], atol=1e-15)


def test_a_positive_pitch_lowers_the_nose() -> None:
    np.testing.assert_allclose(rotation_y(30 * DEGREE) @ FORWARD, [math.sqrt(3) / 2, 0, -0.5], atol=1e-15)


def test_a_positive_yaw_turns_to_the_left() -> None:
    np.testing.assert_allclose(rotation_z(30 * DEGREE) @ FORWARD, [math.sqrt(3) / 2, 0.5, 0], atol=1e-15)


def test_many_yaws_turn_as_each_alone_does() -> None:
    yaws = np.array([0.3, -2.9, 3.3])
    np.testing.assert_array_equal(rotations_z(yaws), [rotation_z(yaw) for yaw in yaws])


def test_pitch_is_applied_after_roll() -> None:
    """Roll by 90 deg turns left into up; a pitch of 90 deg then turns up into forward."""
    np.testing.assert_allclose(rotation_CB(90 * DEGREE, 90 * DEGREE) @ LEFT, FORWARD, atol=1e-15)


def test_euler_angles_of_a_quaternion_in_ros_order() -> None:
    half = 20 * DEGREE
    assert rpy_from_quaternion(np.array([0, 0, math.sin(half), math.cos(half)])) == pytest.approx(
        (0, 0, 40 * DEGREE)
    )
    assert rpy_from_quaternion(np.array([math.sin(half), 0, 0, math.cos(half)])) == pytest.approx(
        (40 * DEGREE, 0, 0)
    )
    # Yaw 90 deg, then pitch 30 deg, of length 3 and negated: the same attitude.
    quarter, pitch = 45 * DEGREE, 15 * DEGREE
    q = np.array(
        [
            -math.sin(quarter) * math.sin(pitch),
            math.cos(quarter) * math.sin(pitch),
            math.sin(quarter) * math.cos(pitch),
            math.cos(quarter) * math.cos(pitch),
        ]
    )
    assert rpy_from_quaternion(-3.0 * q) == pytest.approx((0, 30 * DEGREE, 90 * DEGREE))


def test_euler_angles_straight_down_are_finite() -> None:
    half = math.sqrt(0.5)
    _, pitch, _ = rpy_from_quaternion(np.array([0.0, half * (1 + 1e-12), 0.0, half]))
    assert pitch == pytest.approx(math.pi / 2)


@pytest.mark.parametrize(
    ("angle", "wrapped"),
    [
        (0.3, 0.3),
        (math.pi, math.pi),
        (-math.pi, math.pi),
        (3.5, 3.5 - 2 * math.pi),
        (-10.0, 4 * math.pi - 10),
    ],
)
def test_angles_are_wrapped_to_the_half_open_interval(angle: float, wrapped: float) -> None:
    assert wrap_angle(angle) == pytest.approx(wrapped)
    assert -math.pi < wrap_angle(angle) <= math.pi
