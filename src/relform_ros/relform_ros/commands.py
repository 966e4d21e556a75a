"""Commands to the vehicles to messages and back, bit for bit.

As in ``fields``, ``*_to_msg`` trusts its argument, ``*_from_msg`` raises ``RejectionError``.
"""

import array
from collections.abc import Sequence

import numpy as np
from builtin_interfaces.msg import Duration as DurationMsg

from relform_core.arrays import Array
from relform_core.flight_modes import Request
from relform_core.measurements import RotorCommand
from relform_core.units import NANOSECONDS_PER_SECOND
from relform_msgs.msg import RotorSpeeds as RotorSpeedsMsg
from relform_ros.fields import (
    body_frame,
    bounded,
    duration_to_msg,
    flat,
    header_from_msg,
    header_to_msg,
    number_from_msg,
)
from relform_ros.rejection import Reason, RejectionError


def rotor_command_to_msg(command: RotorCommand, vehicle: str) -> RotorSpeedsMsg:
    """Rotor speeds for a vehicle, and the plan to fall back on."""
    return RotorSpeedsMsg(
        header=header_to_msg(command.stamp_ns, body_frame(vehicle)),
        speeds=flat(command.speeds),
        period=duration_to_msg(command.period_ns),
        predicted_speeds=array.array("d", flat(command.predicted_speeds).tobytes()),
        request=command.request,
    )


def rotor_command_from_msg(msg: RotorSpeedsMsg, vehicle: str) -> RotorCommand:
    """Rotor speeds for a vehicle, and the plan to fall back on.

    Raises:
        RejectionError: see the module; also a plan that is no whole number of intervals, a period of zero, or
            an unknown request.
    """
    return RotorCommand(
        stamp_ns=header_from_msg(msg.header, body_frame(vehicle)),
        period_ns=period_from_msg(msg.period),
        speeds=_speeds(np.array(msg.speeds), "speeds"),
        predicted_speeds=speeds_from_msg(msg.predicted_speeds, "predicted_speeds"),
        request=number_from_msg(Request, msg.request, "request"),
    )


def period_from_msg(msg: DurationMsg) -> int:
    """Length of an interval [ns].

    Raises:
        RejectionError: it is zero or negative.
    """
    period_ns: int = msg.sec * NANOSECONDS_PER_SECOND + msg.nanosec
    if period_ns <= 0:
        raise RejectionError(Reason.INVALID, f"period must be positive (got {period_ns} ns)")
    return period_ns


def check_period(period_ns: int, expected_ns: int) -> None:
    """Compare the length of intervals with that of the control steps [ns].

    Raises:
        RejectionError: they differ.
    """
    if period_ns != expected_ns:
        raise RejectionError(Reason.INVALID, f"period must be {expected_ns} ns (got {period_ns} ns)")


def speeds_from_msg(flattened: Sequence[float], what: str) -> Array:
    """Rotor speeds by interval [rad/s], shape (interval, 4).

    Raises:
        RejectionError: no whole number of intervals, or a speed that is negative or not finite.
    """
    speeds = np.array(flattened, dtype=np.float64)
    if speeds.size % 4:
        raise RejectionError(Reason.INVALID, f"{what} must hold 4 per interval (got {speeds.size})")
    return _speeds(speeds, what).reshape(-1, 4)


def _speeds(speeds: Array, what: str) -> Array:
    if speeds.size and bounded(speeds, what).min() < 0.0:
        raise RejectionError(Reason.INVALID, f"{what} must not be negative (got {speeds.min():g} rad/s)")
    return speeds
