"""relform_msgs/AppliedRotorSpeeds: what a vehicle has flown."""

import array
from collections.abc import Collection

from relform_core.sensors.applied_rotor_speeds import ACKNOWLEDGED_INTERVALS, AppliedRotorSpeeds
from relform_msgs.msg import AppliedRotorSpeeds as AppliedRotorSpeedsMsg
from relform_ros.commands import period_from_msg, speeds_from_msg
from relform_ros.fields import body_frame, duration_to_msg, flat, header_from_msg, header_to_msg
from relform_ros.rejection import Reason, RejectionError

MESSAGE = AppliedRotorSpeedsMsg
NO_COMMAND = -1
"""The value of ``command_stamp`` that stands for no command."""


def to_msg(applied: AppliedRotorSpeeds, vehicle: str) -> AppliedRotorSpeedsMsg:
    """What a vehicle has flown."""
    return AppliedRotorSpeedsMsg(
        header=header_to_msg(applied.stamp_ns, body_frame(vehicle)),
        period=duration_to_msg(applied.period_ns),
        command_stamp=NO_COMMAND if applied.command_stamp_ns is None else applied.command_stamp_ns,
        speeds=array.array("d", flat(applied.speeds).tobytes()),
    )


def from_msg(msg: AppliedRotorSpeedsMsg, vehicle: str, team: Collection[str]) -> AppliedRotorSpeeds:
    """What a vehicle has flown.

    Raises:
        RejectionError: another frame, no valid stamp, no whole number of intervals or too many, a period of
            zero, or a speed that is negative or not finite.
    """
    if msg.command_stamp < NO_COMMAND:
        raise RejectionError(
            Reason.INVALID, f"command_stamp must be at least {NO_COMMAND} (got {msg.command_stamp} ns)"
        )
    if len(msg.speeds) > 4 * ACKNOWLEDGED_INTERVALS:
        raise RejectionError(
            Reason.INVALID,
            f"speeds must hold at most {ACKNOWLEDGED_INTERVALS} intervals (got {len(msg.speeds)} numbers)",
        )
    return AppliedRotorSpeeds(
        stamp_ns=header_from_msg(msg.header, body_frame(vehicle)),
        period_ns=period_from_msg(msg.period),
        speeds=speeds_from_msg(msg.speeds, "speeds"),
        command_stamp_ns=None if msg.command_stamp == NO_COMMAND else msg.command_stamp,
    )
