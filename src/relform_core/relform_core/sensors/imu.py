"""Attitude, angular velocity and specific force."""

from dataclasses import dataclass
from typing import Annotated

from pydantic import Field

from relform_core.arrays import Array
from relform_core.schema import NonNegative
from relform_core.sensors.sensor import Sensor, SensorConfig
from relform_core.units import DEGREES


class ImuConfig(SensorConfig):
    """Attitude, angular velocity and specific force."""

    attitude_std: Annotated[
        float, Field(alias="attitude_std_deg", ge=0.0, le=180.0, examples=[0.005]), DEGREES
    ]
    """Standard deviation of the noise of the attitude about each body axis."""
    gyro_std: Annotated[float, Field(alias="gyro_std_deg_s", ge=0.0, examples=[3.0]), DEGREES]
    """Standard deviation of the noise of the angular velocity about each body axis."""
    accelerometer_std: Annotated[NonNegative, Field(alias="accelerometer_std_m_s2", examples=[0.05])]
    """Standard deviation of the noise of the specific force along each body axis."""
    yaw_drift_std: Annotated[float, Field(alias="yaw_drift_std_deg_s", ge=0.0, examples=[0.2]), DEGREES]
    """Standard deviation of the constant rate at which a follower's yaw drifts, drawn once per flight."""


@dataclass(frozen=True, eq=False)
class Imu:
    """sensor_msgs/Imu (REP-145). Roll and pitch of ``q_NB`` are absolute.

    The leader's yaw is as good as its localization. A follower has no magnetometer: its yaw has an unknown
    constant offset and drifts.
    """

    stamp_ns: int
    q_NB: Array
    """Attitude, shape (4,)."""
    attitude_covariance: Array
    """About body x, y, z [rad^2], shape (3, 3)."""
    w_NB_B: Array
    """Angular velocity [rad/s], shape (3,)."""
    gyro_covariance: Array
    """[(rad/s)^2], shape (3, 3)."""
    f_NB_B: Array
    """Specific force, +g on the z axis at rest [m/s^2], shape (3,)."""
    accelerometer_covariance: Array
    """[(m/s^2)^2], shape (3, 3)."""


IMU = Sensor("imu", Imu, ImuConfig, stream=1)
