"""Quaternions of sensors and plant against scipy.spatial.transform."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from relform_core.rotation import (
    quaternion_from_rotation_vector,
    quaternion_from_yaw,
    quaternion_product,
    rotation_matrix,
    wrap_angle,
)
from relform_sim.rigid_body import rotation_rows

rotation_vectors = st.tuples(*[st.floats(-4.0, 4.0)] * 3).map(np.array)
tiny_rotation_vectors = st.tuples(*[st.floats(-1e-9, 1e-9)] * 3).map(np.array)


@given(rotation_vectors | tiny_rotation_vectors)
def test_from_rotation_vector(vector: np.ndarray) -> None:
    q = quaternion_from_rotation_vector(vector)
    assert np.linalg.norm(q) == pytest.approx(1.0, abs=1e-15)
    assert Rotation.from_quat(q).as_matrix() == pytest.approx(
        Rotation.from_rotvec(vector).as_matrix(), abs=1e-14
    )
    # Small angles keep their relative precision: nothing cancels.
    assert q[:3] == pytest.approx(
        math.copysign(1.0, q[3]) * Rotation.from_rotvec(vector).as_quat(canonical=True)[:3],
        rel=1e-12,
        abs=1e-300,
    )


@given(rotation_vectors, rotation_vectors)
def test_product_and_matrix(a: np.ndarray, b: np.ndarray) -> None:
    R_AB, R_BC = Rotation.from_rotvec(a), Rotation.from_rotvec(b)
    q_AC = quaternion_product(R_AB.as_quat(), R_BC.as_quat())
    expected = (R_AB * R_BC).as_matrix()
    assert rotation_matrix(q_AC) == pytest.approx(expected, abs=1e-14)
    assert np.array(rotation_rows(tuple(q_AC.tolist()))) == pytest.approx(expected, abs=1e-14)


@given(st.floats(-10.0, 10.0))
def test_yaw_and_wrapping(yaw: float) -> None:
    q = quaternion_from_yaw(yaw)
    assert rotation_matrix(q) == pytest.approx(Rotation.from_euler("z", yaw).as_matrix(), abs=1e-14)
    wrapped = wrap_angle(yaw)
    assert -math.pi < wrapped <= math.pi
    assert math.remainder(wrapped - yaw, math.tau) == pytest.approx(0.0, abs=1e-14)


def test_both_limits_wrap_to_plus_pi() -> None:
    assert wrap_angle(-math.pi) == math.pi
    assert wrap_angle(math.pi) == math.pi
    assert wrap_angle(3.0 * math.pi) == pytest.approx(math.pi)
