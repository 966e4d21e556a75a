"""sensor_msgs/Imu: attitude, angular velocity and specific force."""

from collections.abc import Collection

from sensor_msgs.msg import Imu as ImuMsg

from relform_core.sensors.imu import Imu
from relform_ros.fields import (
    body_frame,
    covariance_from_msg,
    flat,
    header_from_msg,
    header_to_msg,
    quaternion_from_msg,
    quaternion_to_msg,
    vector_from_msg,
    vector_to_msg,
)

MESSAGE = ImuMsg


def to_msg(imu: Imu, vehicle: str) -> ImuMsg:
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


def from_msg(msg: ImuMsg, vehicle: str, team: Collection[str]) -> Imu:
    """IMU of a vehicle.

    Raises:
        RejectionError: the message cannot be used, see ``fields``.
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
