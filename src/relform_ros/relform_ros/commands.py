"""Commands to the vehicles to messages and back, bit for bit.

As in ``fields``, ``*_to_msg`` trusts its argument, ``*_from_msg`` raises ``RejectionError``.
"""

import array

import numpy as np

from relform_core.arrays import Array
from relform_core.measurements import RotorCommand
from relform_core.units import NANOSECONDS_PER_SECOND
from relform_msgs.msg import RotorSpeeds as RotorSpeedsMsg
from relform_ros.fields import body_frame, duration_to_msg, finite, flat, header_from_msg, header_to_msg
from relform_ros.rejection import Reason, RejectionError


def rotor_command_to_msg(command: RotorCommand, vehicle: str) -> RotorSpeedsMsg:
    """Rotor speeds for a vehicle, and the plan to fall back on."""
    return RotorSpeedsMsg(
        header=header_to_msg(command.stamp_ns, body_frame(vehicle)),
        speeds=flat(command.speeds),
        period=duration_to_msg(command.period_ns),
        predicted_speeds=array.array("d", flat(command.predicted_speeds).tobytes()),
    )


def rotor_command_from_msg(msg: RotorSpeedsMsg, vehicle: str) -> RotorCommand:
    """Rotor speeds for a vehicle, and the plan to fall back on.

    Raises:
        RejectionError: see the module; also a plan that is no whole number of intervals, or a period of zero.
    """
    stamp_ns = header_from_msg(msg.header, body_frame(vehicle))
    period_ns = msg.period.sec * NANOSECONDS_PER_SECOND + msg.period.nanosec
    if period_ns <= 0:
        raise RejectionError(Reason.INVALID, f"period must be positive (got {period_ns} ns)")
    predicted = np.array(msg.predicted_speeds, dtype=np.float64)
    if predicted.size % 4:
        raise RejectionError(
            Reason.INVALID, f"predicted_speeds must hold 4 per interval (got {predicted.size})"
        )
    return RotorCommand(
        stamp_ns=stamp_ns,
        period_ns=period_ns,
        speeds=_speeds(np.array(msg.speeds), "speeds"),
        predicted_speeds=_speeds(predicted, "predicted_speeds").reshape(-1, 4),
    )


def _speeds(speeds: Array, what: str) -> Array:
    if speeds.size and finite(speeds, what).min() < 0.0:
        raise RejectionError(Reason.INVALID, f"{what} must not be negative (got {speeds.min():g} rad/s)")
    return speeds
