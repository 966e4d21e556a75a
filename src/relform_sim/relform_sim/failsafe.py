"""What a vehicle flies without a plan, on its own sensors alone: first a hover, later a descent."""

import math

import numpy as np

from relform_core.arrays import Array
from relform_core.sensors.imu import Imu
from relform_core.sensors.optic_flow import OpticFlow
from relform_core.units import GRAVITY
from relform_core.vehicle_config import VehicleConfig

CLIMB_GAIN = 3.0
"""Vertical acceleration per error of the vertical speed [1/s]."""
BRAKING_GAIN = 1.0
"""Horizontal acceleration against the horizontal speed in a hover [1/s]."""
ATTITUDE_BANDWIDTH = 6.0
"""Natural frequency of the levelled attitude, critically damped [rad/s]."""
BANDWIDTH_TIMES_PERIOD = 0.3
"""Highest product at which a loop that is closed once per period has a good margin."""
TILT_COSINE_MIN = 0.5
"""Beyond 60 deg the thrust no longer makes up for the tilt."""


class Failsafe:
    """PD control of the tilt, damping of all rates, and a vertical speed, with the speed of the optic flow.

    The yaw of the IMU is not used: on a follower it has an unknown offset.
    """

    def __init__(self, config: VehicleConfig, period: float) -> None:
        """Nominal vehicle, and the time between two calls [s]."""
        self.descent_speed = config.failsafe.descent_speed
        """Vertical speed to settle at, downwards [m/s]; may be changed."""
        self._vehicle = config
        self._inertia = np.array(config.inertia)
        self._bandwidth = min(ATTITUDE_BANDWIDTH, BANDWIDTH_TIMES_PERIOD / period)

    def sink(self, imu: Imu, optic_flow: OpticFlow) -> Array:
        """Level out and sink slowly; the horizontal velocity is not controlled.

        Returns:
            Rotor speeds front, left, back, right, possibly beyond the limits [rad/s], shape (4,).
        """
        return self._fly(imu, optic_flow, _up(imu.q_NB), -self.descent_speed)

    def hover(self, imu: Imu, optic_flow: OpticFlow) -> Array:
        """Brake to zero velocity. Returns rotor speeds as ``sink`` does."""
        up_B = _up(imu.q_NB)
        horizontal_B = optic_flow.v_NB_B - up_B * (up_B @ optic_flow.v_NB_B)
        force_B = GRAVITY * up_B - BRAKING_GAIN * horizontal_B  # per mass
        return self._fly(imu, optic_flow, force_B / np.linalg.norm(force_B), climb_speed=0.0)

    def _fly(self, imu: Imu, optic_flow: OpticFlow, thrust_B: Array, climb_speed: float) -> Array:
        """Turn body z towards a direction, shape (3,), and settle at a vertical speed [m/s]."""
        # Rotation that carries body z to the direction: its axis is e_z x thrust, its angle the error.
        axis_times_sine = np.array([-thrust_B[1], thrust_B[0], 0.0])
        sine = math.hypot(thrust_B[0], thrust_B[1])
        angle = math.atan2(sine, float(thrust_B[2]))
        error = axis_times_sine * (angle / sine if sine > 0.0 else 1.0)
        torque = self._inertia * (self._bandwidth**2 * error - 2.0 * self._bandwidth * imu.w_NB_B)

        up_B = _up(imu.q_NB)
        acceleration = CLIMB_GAIN * (climb_speed - float(up_B @ optic_flow.v_NB_B))
        thrust = self._vehicle.mass * (GRAVITY + acceleration) / max(float(up_B[2]), TILT_COSINE_MIN)
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
