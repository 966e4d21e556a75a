"""Unit quaternions (x, y, z, w), rotation matrices and angles."""

import math

import numpy as np

from relform_core.arrays import Array


def quaternion_product(q_AB: Array, q_BC: Array) -> Array:
    """q_AC, so that ``R_AC = R_AB @ R_BC``; shapes (4,)."""
    ax, ay, az, aw = q_AB.tolist()
    bx, by, bz, bw = q_BC.tolist()
    return np.array(
        [
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
            aw * bw - ax * bx - ay * by - az * bz,
        ]
    )


def quaternion_from_rotation_vector(rotation: Array) -> Array:
    """Quaternion, shape (4,), of a rotation vector (axis times angle [rad]), shape (3,)."""
    half_angle = 0.5 * math.sqrt(rotation.dot(rotation))
    x = math.pi * (half_angle / math.pi)  # rounded as in numpy.sinc, without its overhead
    sine_per_angle = 0.5 * (float(np.sin(x)) / x) if x > 0.0 else 0.5
    return np.array([*(sine_per_angle * each for each in rotation.tolist()), math.cos(half_angle)])


def quaternion_from_yaw(yaw: float) -> Array:
    """Quaternion, shape (4,), of Rz(yaw)."""
    return np.array([0.0, 0.0, math.sin(0.5 * yaw), math.cos(0.5 * yaw)])


def rotation_matrix(q_AB: Array) -> Array:
    """R_AB, shape (3, 3), of q_AB, shape (4,)."""
    x, y, z, w = q_AB.tolist()
    return np.array(
        [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
            [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
            [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
        ]
    )


def wrap_angle(angle: float) -> float:
    """The same angle in (-pi, pi] [rad]."""
    wrapped = math.remainder(angle, math.tau)
    return math.pi if wrapped == -math.pi else wrapped
