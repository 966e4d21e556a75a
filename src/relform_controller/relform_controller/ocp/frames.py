"""Rotations between the frames of the paper, in NumPy.

{n} `N` is the world (ENU); {mb} `B` the body (FLU); {mi} `I` has the position and yaw of the body at the
start of the horizon and zero roll and pitch; {mc} `C` moves with the body, has its yaw and zero roll and
pitch. `R_BA` reads `v_B = R_BA @ v_A`.
"""

import math

import numpy as np

from relform_core.arrays import Array


def wrap_angle(angle: float) -> float:
    """The same angle in (-pi, pi] [rad]."""
    return -((math.pi - angle) % math.tau - math.pi)


def wrap_angles(angles: Array) -> Array:
    """The same angles in (-pi, pi] [rad]."""
    wrapped: Array = -((math.pi - angles) % math.tau - math.pi)
    return wrapped


def rotation_x(roll: float) -> Array:
    """Rotation by ``roll`` [rad] about x, shape (3, 3)."""
    c, s = math.cos(roll), math.sin(roll)
    return np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])


def rotation_y(pitch: float) -> Array:
    """Rotation by ``pitch`` [rad] about y, shape (3, 3)."""
    c, s = math.cos(pitch), math.sin(pitch)
    return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])


def rotation_z(yaw: float) -> Array:
    """Rotation by ``yaw`` [rad] about z, shape (3, 3)."""
    c, s = math.cos(yaw), math.sin(yaw)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def rotations_z(yaws: Array) -> Array:
    """``rotation_z`` of each yaw, shape (n,), to the last bit; shape (n, 3, 3)."""
    angles, rotations = yaws.tolist(), np.zeros((len(yaws), 3, 3))
    # The sine of NumPy differs in the last bit.
    cosines, sines = np.array([math.cos(a) for a in angles]), np.array([math.sin(a) for a in angles])
    rotations[:, 0, 0] = rotations[:, 1, 1] = cosines
    rotations[:, 1, 0] = sines
    rotations[:, 0, 1] = -sines
    rotations[:, 2, 2] = 1.0
    return rotations


def rotation_CB(roll: float, pitch: float) -> Array:
    """R_CB = R_y(pitch) R_x(roll): from the body to {mc}, which has the body's yaw; shape (3, 3)."""
    return rotation_y(pitch) @ rotation_x(roll)


def rpy_from_quaternion(q_NB: Array) -> tuple[float, float, float]:
    """Roll, pitch and yaw (Euler ZYX) [rad] of a quaternion (x, y, z, w) of any non-zero norm."""
    x, y, z, w = q_NB.tolist()
    norm2 = x * x + y * y + z * z + w * w
    roll = math.atan2(2.0 * (w * x + y * z), w * w - x * x - y * y + z * z)
    pitch = math.asin(max(-1.0, min(1.0, 2.0 * (w * y - z * x) / norm2)))
    yaw = math.atan2(2.0 * (w * z + x * y), w * w + x * x - y * y - z * z)
    return roll, pitch, yaw
