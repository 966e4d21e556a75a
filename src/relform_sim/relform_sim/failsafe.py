"""What a vehicle does when it has no plan left: level out and sink slowly, on its own sensors alone."""

import math

import numpy as np

from relform_core.arrays import Array
from relform_core.sensors.imu import Imu
from relform_core.sensors.optic_flow import OpticFlow
from relform_core.units import GRAVITY
from relform_core.vehicle_config import VehicleConfig

DESCENT_GAIN = 3.0
"""Vertical acceleration per error of the vertical speed [1/s]."""
ATTITUDE_BANDWIDTH = 6.0
"""Natural frequency of the levelled attitude, critically damped [rad/s]."""
BANDWIDTH_TIMES_PERIOD = 0.3
"""The most that a loop closed once per period stands with a good margin."""
TILT_COSINE_MIN = 0.5
"""Beyond 60 deg no more thrust is added to make up for the tilt."""


class Failsafe:
    """PD control of the tilt, damping of all rates, and a slow descent, with the speed of the optic flow.

    The yaw of the IMU is not used: it means nothing on a follower. The horizontal velocity is left as it is.
    """

    def __init__(self, config: VehicleConfig, period: float) -> None:
        """Nominal vehicle, and the time between two calls [s]."""
        self.descent_speed = config.failsafe.descent_speed
        """Vertical speed to settle at, downwards [m/s]; may be changed."""
        self._vehicle = config
        self._inertia = np.array(config.inertia)
        self._bandwidth = min(ATTITUDE_BANDWIDTH, BANDWIDTH_TIMES_PERIOD / period)

    def rotor_speeds(self, imu: Imu, optic_flow: OpticFlow) -> Array:
        """Rotor speeds front, left, back, right, possibly beyond the limits [rad/s], shape (4,)."""
        up_B = _up(imu.q_NB)
        tilt_cosine = float(up_B[2])
        # Rotation that carries body z to the vertical: its axis is e_z x up, its angle the tilt.
        axis_times_sine = np.array([-up_B[1], up_B[0], 0.0])
        tilt_sine = math.hypot(up_B[0], up_B[1])
        tilt = math.atan2(tilt_sine, tilt_cosine)
        tilt_error = axis_times_sine * (tilt / tilt_sine if tilt_sine > 0.0 else 1.0)
        torque = self._inertia * (self._bandwidth**2 * tilt_error - 2.0 * self._bandwidth * imu.w_NB_B)

        climb_speed = float(up_B @ optic_flow.v_NB_B)
        acceleration = DESCENT_GAIN * (-self.descent_speed - climb_speed)
        thrust = self._vehicle.mass * (GRAVITY + acceleration) / max(tilt_cosine, TILT_COSINE_MIN)
        return self._mix(thrust, torque)

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


def _up(q_NB: Array) -> Array:
    """The vertical in the body frame, shape (3,): the last row of R_NB, free of yaw."""
    x, y, z, w = q_NB.tolist()
    return np.array([2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)])
