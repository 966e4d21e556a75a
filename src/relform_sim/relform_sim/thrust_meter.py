"""How much of its nominal thrust a vehicle has, by its accelerometer and the rotor speeds that it flew."""

from relform_core.arrays import Array
from relform_core.vehicle_config import VehicleConfig
from relform_sim.pilot import Readings

AVERAGED_S = 1.0
"""Time constant of the average [s]."""
WEAK_S = 2.0
"""For how long the average must be too low [s]: wind from above lasts less."""
HEIGHT_MIN = 0.5
"""Measured height below which the ground may carry the vehicle [m]."""


class ThrustMeter:
    """Averages the measured thrust, and judges whether it is too weak to fly on.

    Args:
        vehicle: nominal.
        period: between two readings [s].
        least: least share of the nominal thrust.
    """

    def __init__(self, vehicle: VehicleConfig, period: float, least: float) -> None:
        self._vehicle = vehicle
        self._period = period
        self._least = least
        self.reset()

    def reset(self) -> None:
        """Forget what was measured: the vehicle stands on the ground."""
        self.share = 1.0
        """Measured thrust over nominal thrust."""
        self.is_weak = False
        """Whether it was too weak; until the vehicle stands on the ground."""
        self._weak_for = 0.0
        """[s]"""

    def sense(self, readings: Readings, applied: Array) -> None:
        """Take in what was measured at the end of an interval in the air.

        Args:
            readings: then.
            applied: rotor speeds of the interval [rad/s], shape (4,).
        """
        nominal = self._vehicle.thrust_coefficient * float(applied @ applied)
        if readings.sonar.range < HEIGHT_MIN or nominal <= 0.0:
            return
        measured = self._vehicle.mass * float(readings.imu.f_NB_B[2])
        weight = self._period / (AVERAGED_S + self._period)
        self.share += weight * (measured / nominal - self.share)
        self._weak_for = self._weak_for + self._period if self.share < self._least else 0.0
        self.is_weak |= self._weak_for >= WEAK_S
