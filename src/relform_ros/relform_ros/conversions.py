"""Core types to messages and back, bit for bit.

``*_to_msg`` trusts its argument; ``*_from_msg`` does not: whatever came over the wire and cannot be used
raises ``RejectionError`` with the reason, so that nothing behind it has to check again.
"""

import array

import numpy as np
from nav_msgs.msg import Odometry as OdometryMsg

from relform_core.arrays import Array
from relform_core.measurements import Odometry, RotorCommand
from relform_core.units import NANOSECONDS_PER_SECOND
from relform_msgs.msg import RotorSpeeds as RotorSpeedsMsg
from relform_msgs.msg import StepDone as StepDoneMsg
from relform_ros.fields import (
    WORLD_FRAME,
    body_frame,
    check_frame,
    covariance_from_msg,
    duration_to_msg,
    finite,
    flat,
    header_from_msg,
    header_to_msg,
    point_to_msg,
    quaternion_from_msg,
    quaternion_to_msg,
    vector_from_msg,
    vector_to_msg,
)
from relform_ros.lockstep import JOINED, Done
from relform_ros.rejection import Reason, RejectionError


def odometry_to_msg(odometry: Odometry, vehicle: str) -> OdometryMsg:
    """Ground truth of a vehicle, or the leader's localization."""
    msg = OdometryMsg(
        header=header_to_msg(odometry.stamp_ns, WORLD_FRAME), child_frame_id=body_frame(vehicle)
    )
    msg.pose.pose.position = point_to_msg(odometry.p_NB_N)
    msg.pose.pose.orientation = quaternion_to_msg(odometry.q_NB)
    msg.pose.covariance = flat(odometry.pose_covariance)
    msg.twist.twist.linear = vector_to_msg(odometry.v_NB_B)
    msg.twist.twist.angular = vector_to_msg(odometry.w_NB_B)
    msg.twist.covariance = flat(odometry.twist_covariance)
    return msg


def odometry_from_msg(msg: OdometryMsg, vehicle: str) -> Odometry:
    """Ground truth of a vehicle, or the leader's localization.

    Raises:
        RejectionError: see the module.
    """
    stamp_ns = header_from_msg(msg.header, WORLD_FRAME)
    check_frame(msg.child_frame_id, body_frame(vehicle), "child_frame_id")
    return Odometry(
        stamp_ns=stamp_ns,
        p_NB_N=vector_from_msg(msg.pose.pose.position, "position"),
        q_NB=quaternion_from_msg(msg.pose.pose.orientation, "orientation"),
        v_NB_B=vector_from_msg(msg.twist.twist.linear, "twist.linear"),
        w_NB_B=vector_from_msg(msg.twist.twist.angular, "twist.angular"),
        pose_covariance=covariance_from_msg(msg.pose.covariance, 6, "pose.covariance"),
        twist_covariance=covariance_from_msg(msg.twist.covariance, 6, "twist.covariance"),
    )


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


def done_to_msg(done: Done, stamp_ns: int) -> StepDoneMsg:
    """What a member says when it has finished a step, at the instant of the step."""
    return StepDoneMsg(
        header=header_to_msg(stamp_ns),
        step=done.step,
        node=done.node,
        sent=list(done.sent),
        fault=done.fault,
        configuration=done.configuration,
    )


def done_from_msg(msg: StepDoneMsg, node: str) -> Done:
    """What the member ``node`` says when it has finished a step.

    Raises:
        RejectionError: another node says so, or no possible step.
    """
    if msg.node != node:
        raise RejectionError(Reason.FOREIGN, f"node must be '{node}' (got '{msg.node}')")
    if msg.step < JOINED:
        raise RejectionError(Reason.INVALID, f"step must be at least {JOINED} (got {msg.step})")
    return Done(
        node=msg.node,
        step=msg.step,
        sent=tuple(msg.sent),
        fault=msg.fault,
        configuration=msg.configuration,
    )


def _speeds(speeds: Array, what: str) -> Array:
    if speeds.size and finite(speeds, what).min() < 0.0:
        raise RejectionError(Reason.INVALID, f"{what} must not be negative (got {speeds.min():g} rad/s)")
    return speeds
