"""Core types to messages and back, bit for bit.

``*_to_msg`` trusts its argument; ``*_from_msg`` does not: whatever came over the wire and cannot be used
raises ``RejectionError`` with the reason, so that nothing behind it has to check again.
"""

import array
import math
from collections.abc import Collection

import numpy as np
from geometry_msgs.msg import TwistWithCovarianceStamped as TwistMsg
from nav_msgs.msg import Odometry as OdometryMsg
from sensor_msgs.msg import Imu as ImuMsg
from sensor_msgs.msg import Range as RangeMsg

from relform_core.arrays import Array
from relform_core.measurements import Odometry, RotorCommand
from relform_core.sensors.imu import Imu
from relform_core.sensors.optic_flow import OpticFlow
from relform_core.sensors.range_bearing import RangeBearing, RangeBearings
from relform_core.sensors.sonar import Sonar
from relform_core.units import NANOSECONDS_PER_SECOND
from relform_msgs.msg import RangeBearing as RangeBearingMsg
from relform_msgs.msg import RangeBearingArray as RangeBearingArrayMsg
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

UNMEASURED_VARIANCE = 1e9
"""Variance that says: this component of a standard message is not measured."""


def imu_to_msg(imu: Imu, vehicle: str) -> ImuMsg:
    """IMU of a vehicle."""
    return ImuMsg(
        header=header_to_msg(imu.stamp_ns, body_frame(vehicle)),
        orientation=quaternion_to_msg(imu.q_NB),
        orientation_covariance=flat(imu.attitude_covariance),
        angular_velocity=vector_to_msg(imu.w_NB_B),
        angular_velocity_covariance=flat(imu.gyro_covariance),
        linear_acceleration=vector_to_msg(imu.f_NB_B),
        linear_acceleration_covariance=flat(imu.accelerometer_covariance),
    )


def imu_from_msg(msg: ImuMsg, vehicle: str) -> Imu:
    """IMU of a vehicle.

    Raises:
        RejectionError: see the module.
    """
    return Imu(
        stamp_ns=header_from_msg(msg.header, body_frame(vehicle)),
        q_NB=quaternion_from_msg(msg.orientation, "orientation"),
        attitude_covariance=covariance_from_msg(msg.orientation_covariance, 3, "orientation_covariance"),
        w_NB_B=vector_from_msg(msg.angular_velocity, "angular_velocity"),
        gyro_covariance=covariance_from_msg(
            msg.angular_velocity_covariance, 3, "angular_velocity_covariance"
        ),
        f_NB_B=vector_from_msg(msg.linear_acceleration, "linear_acceleration"),
        accelerometer_covariance=covariance_from_msg(
            msg.linear_acceleration_covariance, 3, "linear_acceleration_covariance"
        ),
    )


def optic_flow_to_msg(flow: OpticFlow, vehicle: str) -> TwistMsg:
    """Velocity measured by the optic flow of a vehicle; its angular part is not measured."""
    covariance = np.diag([0.0, 0.0, 0.0, UNMEASURED_VARIANCE, UNMEASURED_VARIANCE, UNMEASURED_VARIANCE])
    covariance[:3, :3] = flow.covariance
    msg = TwistMsg(header=header_to_msg(flow.stamp_ns, body_frame(vehicle)))
    msg.twist.twist.linear = vector_to_msg(flow.v_NB_B)
    msg.twist.covariance = flat(covariance)
    return msg


def optic_flow_from_msg(msg: TwistMsg, vehicle: str) -> OpticFlow:
    """Velocity measured by the optic flow of a vehicle.

    Raises:
        RejectionError: see the module.
    """
    return OpticFlow(
        stamp_ns=header_from_msg(msg.header, body_frame(vehicle)),
        v_NB_B=vector_from_msg(msg.twist.twist.linear, "twist.linear"),
        covariance=covariance_from_msg(msg.twist.covariance, 6, "covariance")[:3, :3].copy(),
    )


def sonar_to_msg(sonar: Sonar, vehicle: str) -> RangeMsg:
    """Height above ground of a vehicle; the message is in float32, and so are the values of ``Sonar``."""
    return RangeMsg(
        header=header_to_msg(sonar.stamp_ns, body_frame(vehicle)),
        radiation_type=RangeMsg.ULTRASOUND,
        field_of_view=sonar.field_of_view,
        min_range=sonar.range_min,
        max_range=sonar.range_max,
        range=sonar.range,
    )


def sonar_from_msg(msg: RangeMsg, vehicle: str) -> Sonar:
    """Height above ground of a vehicle; infinite ranges mean out of range (REP-117).

    Raises:
        RejectionError: see the module.
    """
    stamp_ns = header_from_msg(msg.header, body_frame(vehicle))
    for what in ("field_of_view", "min_range", "max_range"):
        if not 0.0 <= getattr(msg, what) < math.inf:
            raise RejectionError(
                Reason.INVALID, f"{what} must be finite and not negative (got {getattr(msg, what)})"
            )
    if math.isnan(msg.range) or -math.inf < msg.range < 0.0:
        raise RejectionError(Reason.INVALID, f"range must be non-negative or infinite (got {msg.range})")
    return Sonar(
        stamp_ns=stamp_ns,
        range=msg.range,
        range_min=msg.min_range,
        range_max=msg.max_range,
        field_of_view=msg.field_of_view,
    )


def range_bearings_to_msg(bearings: RangeBearings, vehicle: str) -> RangeBearingArrayMsg:
    """All that a vehicle sees."""
    return RangeBearingArrayMsg(
        header=header_to_msg(bearings.stamp_ns, body_frame(vehicle)),
        observations=[
            RangeBearingMsg(
                target_id=bearing.target,
                range=bearing.range,
                azimuth=bearing.azimuth,
                elevation=bearing.elevation,
                covariance=flat(bearing.covariance),
            )
            for bearing in bearings.by_target.values()
        ],
    )


def range_bearings_from_msg(msg: RangeBearingArrayMsg, vehicle: str, team: Collection[str]) -> RangeBearings:
    """All that a vehicle sees.

    Args:
        team: names of all vehicles.
    Raises:
        RejectionError: see the module; also a target that is unknown or named twice.
    """
    stamp_ns = header_from_msg(msg.header, body_frame(vehicle))
    by_target: dict[str, RangeBearing] = {}
    for observation in msg.observations:
        target = observation.target_id
        if target not in team or target == vehicle:
            raise RejectionError(Reason.FOREIGN, f"target '{target}' is none of the others in the team")
        if target in by_target:
            raise RejectionError(Reason.INVALID, f"target '{target}' is named twice")
        by_target[target] = _range_bearing_from_msg(observation)
    return RangeBearings(stamp_ns=stamp_ns, by_target=by_target)


def _range_bearing_from_msg(msg: RangeBearingMsg) -> RangeBearing:
    for what, usable, bounds in (
        ("range", 0.0 < msg.range < math.inf, "positive and finite"),
        ("azimuth", abs(msg.azimuth) <= math.pi, "in [-pi, pi]"),
        ("elevation", abs(msg.elevation) <= math.pi / 2, "in [-pi/2, pi/2]"),
    ):
        if not usable:
            value = getattr(msg, what)
            raise RejectionError(
                Reason.INVALID, f"{what} to '{msg.target_id}' must be {bounds} (got {value})"
            )
    return RangeBearing(
        target=msg.target_id,
        range=msg.range,
        azimuth=msg.azimuth,
        elevation=msg.elevation,
        covariance=covariance_from_msg(msg.covariance, 3, "covariance"),
    )


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
