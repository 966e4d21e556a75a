"""Fields that many messages share: stamps, headers, vectors, quaternions, covariances.

Here as in all conversions, ``*_to_msg`` trusts its argument and ``*_from_msg`` does not: it raises
``RejectionError`` with the reason for everything that cannot be used, so that no code after it checks again.
"""

import math
from enum import IntEnum
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt
from builtin_interfaces.msg import Duration as DurationMsg
from builtin_interfaces.msg import Time as TimeMsg
from geometry_msgs.msg import Point as PointMsg
from geometry_msgs.msg import Quaternion as QuaternionMsg
from geometry_msgs.msg import Vector3 as Vector3Msg
from std_msgs.msg import Header as HeaderMsg

from relform_core.arrays import Array
from relform_core.units import NANOSECONDS_PER_SECOND
from relform_ros.rejection import Reason, RejectionError

E = TypeVar("E", bound=IntEnum)

WORLD_FRAME = "map"
"""Frame id of the world {n}."""
QUATERNION_NORM_TOLERANCE = 1e-3
MAGNITUDE_MAX = 1e8
"""No position, velocity, acceleration or rotor speed of a flight is beyond this [SI units]; squares of larger
numbers would spoil what is computed with them."""


def body_frame(vehicle: str) -> str:
    """Frame id of the body {b} of a vehicle."""
    return f"{vehicle}/base_link"


def stamp_to_msg(stamp_ns: int) -> TimeMsg:
    """Nanoseconds of simulation time, >= 0."""
    seconds, nanoseconds = divmod(stamp_ns, NANOSECONDS_PER_SECOND)
    return TimeMsg(sec=seconds, nanosec=nanoseconds)


def stamp_from_msg(msg: TimeMsg) -> int:
    """Nanoseconds of simulation time.

    Raises:
        RejectionError: negative, or the nanoseconds are a second or more.
    """
    if msg.sec < 0 or msg.nanosec >= NANOSECONDS_PER_SECOND:
        raise RejectionError(Reason.INVALID, f"{msg.sec} s + {msg.nanosec} ns is no valid stamp")
    return int(msg.sec * NANOSECONDS_PER_SECOND + msg.nanosec)


def duration_to_msg(duration_ns: int) -> DurationMsg:
    """Nanoseconds."""
    seconds, nanoseconds = divmod(duration_ns, NANOSECONDS_PER_SECOND)
    return DurationMsg(sec=seconds, nanosec=nanoseconds)


def header_to_msg(stamp_ns: int, frame_id: str = "") -> HeaderMsg:
    """Header with a stamp in simulation time; no frame where there is no geometry."""
    return HeaderMsg(stamp=stamp_to_msg(stamp_ns), frame_id=frame_id)


def header_from_msg(msg: HeaderMsg, frame_id: str) -> int:
    """Stamp of a header whose frame must be ``frame_id`` [ns].

    Raises:
        RejectionError: another frame, or no valid time.
    """
    check_frame(msg.frame_id, frame_id, "frame_id")
    return stamp_from_msg(msg.stamp)


def check_frame(frame_id: str, expected: str, what: str) -> None:
    """Compare frame ids.

    Raises:
        RejectionError: they differ.
    """
    if frame_id != expected:
        raise RejectionError(Reason.FOREIGN, f"{what} must be '{expected}' (got '{frame_id}')")


def number_from_msg(kind: type[E], number: int, what: str) -> E:
    """Member of an enum with consecutive numbers.

    Raises:
        RejectionError: it has no such member.
    """
    try:
        return kind(number)
    except ValueError:
        lowest, highest = int(min(kind)), int(max(kind))
        raise RejectionError(Reason.INVALID, f"{what} must be {lowest} to {highest} (got {number})") from None


def check_lengths(msg: Any, names: str, values: str) -> None:
    """Compare the lengths of two fields of a message.

    Raises:
        RejectionError: they differ.
    """
    lengths = len(getattr(msg, names)), len(getattr(msg, values))
    if lengths[0] != lengths[1]:
        raise RejectionError(
            Reason.INVALID, f"{names} and {values} must have the same length (got {lengths[0]}, {lengths[1]})"
        )


def vector_to_msg(vector: Array) -> Vector3Msg:
    """Vector of shape (3,)."""
    x, y, z = vector.tolist()
    return Vector3Msg(x=x, y=y, z=z)


def point_to_msg(position: Array) -> PointMsg:
    """Position of shape (3,)."""
    x, y, z = position.tolist()
    return PointMsg(x=x, y=y, z=z)


def vector_from_msg(msg: Vector3Msg | PointMsg, what: str) -> Array:
    """Vector of shape (3,).

    Raises:
        RejectionError: not finite, or beyond MAGNITUDE_MAX.
    """
    return bounded(np.array([msg.x, msg.y, msg.z]), what)


def quaternion_to_msg(quaternion: Array) -> QuaternionMsg:
    """Quaternion (x, y, z, w) of shape (4,)."""
    x, y, z, w = quaternion.tolist()
    return QuaternionMsg(x=x, y=y, z=z, w=w)


def quaternion_from_msg(msg: QuaternionMsg, what: str) -> Array:
    """Quaternion (x, y, z, w) of shape (4,), as sent: a norm near 1 is not corrected.

    Raises:
        RejectionError: not finite, or no unit quaternion.
    """
    quaternion = finite(np.array([msg.x, msg.y, msg.z, msg.w]), what)
    norm = math.hypot(msg.x, msg.y, msg.z, msg.w)
    if abs(norm - 1.0) > QUATERNION_NORM_TOLERANCE:
        raise RejectionError(Reason.INVALID, f"{what} must be a unit quaternion (got norm {norm:g})")
    return quaternion


def covariance_from_msg(values: npt.ArrayLike, size: int, what: str) -> Array:
    """Covariance of shape (size, size).

    Raises:
        RejectionError: not finite, or a negative variance.
    """
    covariance = finite(np.array(values, dtype=np.float64), what).reshape(size, size)
    if covariance.diagonal().min() < 0.0:
        raise RejectionError(Reason.INVALID, f"{what} must not have negative variances")
    return covariance


def finite(values: Array, what: str) -> Array:
    """The values themselves.

    Raises:
        RejectionError: one is NaN or infinite.
    """
    if not np.isfinite(values).all():
        raise RejectionError(Reason.INVALID, f"{what} must be finite (got {_some(values)})")
    return values


def bounded(values: Array, what: str) -> Array:
    """The values themselves.

    Raises:
        RejectionError: one is NaN, infinite or beyond MAGNITUDE_MAX.
    """
    if not (np.abs(values) <= MAGNITUDE_MAX).all():
        finite(values, what)
        raise RejectionError(Reason.INVALID, f"{what} must be within {MAGNITUDE_MAX:g} (got {_some(values)})")
    return values


def _some(values: Array) -> list[float]:
    """The first values, for people."""
    some: list[float] = values.reshape(-1)[:6].tolist()
    return some


def flat(values: Array) -> Array:
    """The values row by row, as messages hold arrays.

    Messages do not check what they are given; serialisation reads the memory of a contiguous float64 array.
    """
    return np.ascontiguousarray(values, dtype=np.float64).reshape(-1)
