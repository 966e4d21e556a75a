"""nav_msgs/Odometry: position, velocity and yaw of the leader."""

from collections.abc import Collection

from nav_msgs.msg import Odometry as OdometryMsg

from relform_core.measurements import Odometry
from relform_ros.odometry import odometry_from_msg, odometry_to_msg

MESSAGE = OdometryMsg

to_msg = odometry_to_msg


def from_msg(msg: OdometryMsg, vehicle: str, team: Collection[str]) -> Odometry:
    """Localization of a vehicle.

    Raises:
        RejectionError: see ``odometry_from_msg``.
    """
    return odometry_from_msg(msg, vehicle)
