"""Attitude, angular velocity and specific force."""

import math

import numpy as np

from relform_core.arrays import Array
from relform_core.measurements import Odometry
from relform_core.rotation import (
    quaternion_from_rotation_vector,
    quaternion_from_yaw,
    quaternion_product,
)
from relform_core.sensors.imu import Imu, ImuConfig
from relform_core.units import NANOSECONDS_PER_SECOND
from relform_sensors.model import Carrier, Read

UNKNOWN_YAW_VARIANCE = math.pi**2 / 3.0
"""Variance of an unknown yaw, uniform in (-pi, pi] [rad^2]."""


class ImuSensor:
    """IMU without magnetometer: roll and pitch are absolute.

    The yaw has an unknown constant offset and drifts at an unknown constant rate, both drawn once per flight.
    With ``yaw_is_known`` (the leader, which has a localization) it is as good as roll and pitch.
    """

    def __init__(self, config: ImuConfig, generator: np.random.Generator, *, yaw_is_known: bool) -> None:
        self._config = config
        self._generator = generator
        yaw_offset = math.pi - generator.uniform(0.0, math.tau)  # in (-pi, pi]
        yaw_drift_rate = config.yaw_drift_std * generator.standard_normal()
        self.yaw_offset = 0.0 if yaw_is_known else yaw_offset
        self.yaw_drift_rate = 0.0 if yaw_is_known else yaw_drift_rate
        attitude_variance = config.attitude_std**2
        yaw_variance = attitude_variance if yaw_is_known else UNKNOWN_YAW_VARIANCE
        self._attitude_covariance = np.diag([attitude_variance, attitude_variance, yaw_variance])
        self._gyro_covariance = config.gyro_std**2 * np.eye(3)
        self._accelerometer_covariance = config.accelerometer_std**2 * np.eye(3)

    def read(self, truth: Odometry, f_NB_B: Array) -> Imu:
        """Measure.

        Args:
            truth: state of the vehicle.
            f_NB_B: its true specific force [m/s^2], shape (3,).
        """
        rotation_noise, gyro_noise, force_noise = self._generator.standard_normal((3, 3))
        yaw_error = self.yaw_offset + self.yaw_drift_rate * (truth.stamp_ns / NANOSECONDS_PER_SECOND)
        # The unknown yaw turns the world about its vertical; the noise turns the body about its own axes.
        q_NB__unaligned = quaternion_product(quaternion_from_yaw(yaw_error), truth.q_NB)
        q_noise = quaternion_from_rotation_vector(self._config.attitude_std * rotation_noise)
        return Imu(
            stamp_ns=truth.stamp_ns,
            q_NB=quaternion_product(q_NB__unaligned, q_noise),
            attitude_covariance=self._attitude_covariance,
            w_NB_B=truth.w_NB_B + self._config.gyro_std * gyro_noise,
            gyro_covariance=self._gyro_covariance,
            f_NB_B=f_NB_B + self._config.accelerometer_std * force_noise,
            accelerometer_covariance=self._accelerometer_covariance,
        )


def mount(config: ImuConfig, generator: np.random.Generator, carrier: Carrier) -> Read:
    """The model on this vehicle."""
    sensor = ImuSensor(config, generator, yaw_is_known=carrier.is_leader)
    return lambda scene: sensor.read(scene.own, scene.f_NB_B)
