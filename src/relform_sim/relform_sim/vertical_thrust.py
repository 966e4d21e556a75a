"""Rotor speeds that give a vehicle another vertical speed, and leave it the torques that it wants."""

import numpy as np

from relform_core.arrays import Array
from relform_core.units import GRAVITY
from relform_core.vehicle_config import VehicleConfig
from relform_sim.pilot import Readings
from relform_sim.tilt_control import TILT_COSINE_MIN, up_direction

GAIN = 8.0
"""Vertical acceleration per error of the speed [1/s]."""


class VerticalThrust:
    """Control of the vertical speed, on top of what flies the vehicle.

    Args:
        vehicle: nominal.
    """

    def __init__(self, vehicle: VehicleConfig) -> None:
        self._vehicle = vehicle
        self._thrust_min = vehicle.thrust_coefficient * vehicle.rotor_speed_min**2
        self._thrust_max = vehicle.thrust_coefficient * vehicle.rotor_speed_max**2

    def rotor_speeds(self, planned: Array, readings: Readings, climb: float) -> Array:
        """Rotor speeds for one interval.

        Args:
            planned: what the vehicle would fly else: front, left, back, right [rad/s], shape (4,).
            readings: at the start of the interval.
            climb: vertical speed [m/s].
        Returns:
            The torques of ``planned`` with the thrust for the vertical speed, as far as the limits allow:
            torques come first. Shape (4,).
        """
        up_B = up_direction(readings.imu.q_NB)
        acceleration = GAIN * (climb - float(up_B @ readings.optic_flow.v_NB_B))
        thrusts = self._vehicle.thrust_coefficient * np.square(planned)
        torques = thrusts - thrusts.mean()
        upright = max(float(up_B[2]), TILT_COSINE_MIN)
        mean = self._vehicle.mass * (GRAVITY + acceleration) / (4.0 * upright)
        mean = min(mean, self._thrust_max - torques.max())
        mean = max(mean, self._thrust_min - torques.min())
        changed = np.clip(mean + torques, self._thrust_min, self._thrust_max)
        speeds: Array = np.sqrt(changed / self._vehicle.thrust_coefficient)
        return speeds
