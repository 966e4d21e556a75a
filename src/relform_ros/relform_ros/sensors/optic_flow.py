"""geometry_msgs/TwistWithCovarianceStamped: velocity in the body frame."""

from collections.abc import Collection

import numpy as np
from geometry_msgs.msg import TwistWithCovarianceStamped as TwistMsg

from relform_core.measurements import UNMEASURED_VARIANCE
from relform_core.sensors.optic_flow import OpticFlow
from relform_ros.fields import (
    body_frame,
    covariance_from_msg,
    flat,
    header_from_msg,
    header_to_msg,
    vector_from_msg,
    vector_to_msg,
)

MESSAGE = TwistMsg


def to_msg(flow: OpticFlow, vehicle: str) -> TwistMsg:
    """Velocity measured by the optic flow of a vehicle; its angular part is not measured."""
    covariance = np.diag([0.0, 0.0, 0.0, UNMEASURED_VARIANCE, UNMEASURED_VARIANCE, UNMEASURED_VARIANCE])
    covariance[:3, :3] = flow.covariance
    msg = TwistMsg(header=header_to_msg(flow.stamp_ns, body_frame(vehicle)))
    msg.twist.twist.linear = vector_to_msg(flow.v_NB_B)
    msg.twist.covariance = flat(covariance)
    return msg


def from_msg(msg: TwistMsg, vehicle: str, team: Collection[str]) -> OpticFlow:
    """Velocity measured by the optic flow of a vehicle.

    Raises:
        RejectionError: the message cannot be used, see ``fields``.
    """
    return OpticFlow(
        stamp_ns=header_from_msg(msg.header, body_frame(vehicle)),
        v_NB_B=vector_from_msg(msg.twist.twist.linear, "twist.linear"),
        covariance=covariance_from_msg(msg.twist.covariance, 6, "covariance")[:3, :3].copy(),
    )
