"""Poses with velocities to messages and back, bit for bit.

As in ``fields``, ``*_to_msg`` trusts its argument, ``*_from_msg`` raises ``RejectionError``.
"""

from nav_msgs.msg import Odometry as OdometryMsg

from relform_core.measurements import Odometry
from relform_ros.fields import (
    WORLD_FRAME,
    body_frame,
    check_frame,
    covariance_from_msg,
    flat,
    header_from_msg,
    header_to_msg,
    point_to_msg,
    quaternion_from_msg,
    quaternion_to_msg,
    vector_from_msg,
    vector_to_msg,
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
