"""Rotor speeds that turn the thrust of a vehicle to a direction, with a vertical acceleration."""

import math

import numpy as np

from relform_core.arrays import Array
from relform_core.sensors.imu import Imu
from relform_core.units import GRAVITY
from relform_core.vehicle_config import VehicleConfig

ATTITUDE_BANDWIDTH = 6.0
"""Natural frequency of the levelled attitude, critically damped [rad/s]."""
BANDWIDTH_TIMES_PERIOD = 0.3
"""Highest product at which a loop that is closed once per period has a good margin."""
TILT_COSINE_MIN = 0.5
"""Beyond 60 deg the thrust no longer makes up for the tilt."""


class TiltControl:
    """PD control of the tilt, and damping of all rates, with the IMU."""

    def __init__(self, config: VehicleConfig, period: float) -> None:
        """Nominal vehicle, and the time between two calls [s]."""
        self._vehicle = config
        self._inertia = np.array(config.inertia)
        self._bandwidth = min(ATTITUDE_BANDWIDTH, BANDWIDTH_TIMES_PERIOD / period)

    def rotor_speeds(self, imu: Imu, thrust_B: Array, acceleration: float, yaw_error: float = 0.0) -> Array:
        """Turn body z towards a direction.

        Args:
            imu: of this instant.
            thrust_B: the direction, of any length, shape (3,).
            acceleration: upwards [m/s^2].
            yaw_error: by which the vehicle should turn to the left [rad].
        Returns:
            Rotor speeds front, left, back, right, possibly beyond the limits [rad/s], shape (4,).
        """
        # Rotation that carries body z to the direction: its axis is e_z x thrust, its angle the error.
        axis_times_sine = np.array([-thrust_B[1], thrust_B[0], 0.0])
        sine = math.hypot(thrust_B[0], thrust_B[1])
        angle = math.atan2(sine, float(thrust_B[2]))
        error = axis_times_sine * (angle / sine if sine > 0.0 else 1.0)
        error[2] = yaw_error
        torque = self._inertia * (self._bandwidth**2 * error - 2.0 * self._bandwidth * imu.w_NB_B)
        upright = max(float(up_direction(imu.q_NB)[2]), TILT_COSINE_MIN)
        return self._mix(self._vehicle.mass * (GRAVITY + acceleration) / upright, torque)

    def _mix(self, thrust: float, torque: Array) -> Array:
        """Inverse of eq. Aerodynamics."""
        arm, c_T, c_Q = (
            self._vehicle.arm_length,
            self._vehicle.thrust_coefficient,
            self._vehicle.torque_coefficient,
        )
        roll, pitch = torque[0] / (2.0 * arm), torque[1] / (2.0 * arm)
        yaw = torque[2] * c_T / (4.0 * c_Q)
        thrusts = thrust / 4.0 + np.array([yaw - pitch, roll - yaw, yaw + pitch, -roll - yaw])
        return np.sqrt(np.maximum(thrusts, 0.0) / c_T)


def up_direction(q_NB: Array) -> Array:
    """The vertical in the body frame, shape (3,): the last row of R_NB, free of yaw."""
    x, y, z, w = q_NB.tolist()
    return np.array([2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)])
