"""Rotations against SciPy, over all attitudes."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from relform_controller.ocp.frames import (
    rotation_CB,
    rotation_x,
    rotation_y,
    rotation_z,
    rpy_from_quaternion,
    wrap_angle,
)

angles = st.floats(-math.pi, math.pi)
pitches = st.floats(-1.5, 1.5)


@given(angle=st.floats(-1e4, 1e4))
def test_single_rotations(angle: float) -> None:
    for axis, rotation in (("x", rotation_x), ("y", rotation_y), ("z", rotation_z)):
        np.testing.assert_allclose(
            rotation(angle), Rotation.from_euler(axis, angle).as_matrix(), rtol=0, atol=1e-11
        )


@given(roll=angles, pitch=pitches, yaw=angles)
def test_attitude_is_yaw_after_levelling(roll: float, pitch: float, yaw: float) -> None:
    R_NB = Rotation.from_euler("ZYX", [yaw, pitch, roll])
    np.testing.assert_allclose(rotation_z(yaw) @ rotation_CB(roll, pitch), R_NB.as_matrix(), atol=1e-14)


@given(roll=angles, pitch=pitches, yaw=angles, length=st.floats(1e-3, 1e3))
def test_euler_angles_give_the_same_attitude(roll: float, pitch: float, yaw: float, length: float) -> None:
    R_NB = Rotation.from_euler("ZYX", [yaw, pitch, roll])
    found_roll, found_pitch, found_yaw = rpy_from_quaternion(length * R_NB.as_quat())
    again = Rotation.from_euler("ZYX", [found_yaw, found_pitch, found_roll])
    assert (R_NB.inv() * again).magnitude() == pytest.approx(0, abs=1e-7)
    assert found_pitch == pytest.approx(pitch, abs=1e-7)


@given(angle=st.floats(-1e6, 1e6))
def test_a_wrapped_angle_is_the_same_direction(angle: float) -> None:
    wrapped = wrap_angle(angle)
    assert -math.pi <= wrapped <= math.pi
    assert math.cos(wrapped) == pytest.approx(math.cos(angle), abs=1e-9)
    assert math.sin(wrapped) == pytest.approx(math.sin(angle), abs=1e-9)
