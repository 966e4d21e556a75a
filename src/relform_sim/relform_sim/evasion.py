"""What a vehicle does on board when another one is too close, by the ranges and bearings that it measures.

Of two vehicles that meet, one rises and the other sinks: the thrust of a quadrotor changes at once, its tilt
does not. The higher one rises; at about the same height, the one that comes first in team order. Each keeps
the torques of what it flies, so that it turns and tilts as its controller, or its pilot, wants.
"""

import math

import numpy as np

from relform_core.arrays import Array
from relform_core.sensors.range_bearing import RangeBearing
from relform_core.separation_config import SeparationConfig
from relform_core.units import GRAVITY
from relform_core.vehicle_config import VehicleConfig
from relform_sim.axis_filter import AxisFilter
from relform_sim.pilot import Readings
from relform_sim.tilt_control import TILT_COSINE_MIN, up_direction

RANGE_ACCELERATION_STD = 8.0
"""Of the range, whose acceleration is not known [m/s^2]."""
RANGE_RATE_STD = 0.3
"""Rate of a range when it is first measured [m/s]."""
GATE = 4.0
"""A range that is off by more standard deviations is an outlier, ..."""
OUTLIERS_MAX = 2
"""... unless more than these come one after the other."""
UNSEEN_MAX_S = 0.25
"""A neighbour that was not in view for this time is forgotten [s]."""
REACTION_S = 0.2
"""Time from a measurement to the motion that answers it [s]."""
BRAKING = 3.0
"""Relative acceleration with which two vehicles that evade each other come apart [m/s^2]."""
SPEED = 1.5
"""Vertical speed of an evasion [m/s]."""
GAIN = 8.0
"""Vertical acceleration per error of the speed [1/s]."""
SAME_HEIGHT = 0.2
"""Sine of the elevation up to which two vehicles are at about the same height."""
HEIGHT_MIN = 0.6
"""Measured height below which a vehicle does not sink [m]."""


class _Neighbour:
    """One vehicle in view, and how its range changes."""

    def __init__(self, seen: RangeBearing) -> None:
        self.seen = seen
        """When it was last in view."""
        self.unseen = 0.0
        """Time since then [s]."""
        self._n_outliers = 0
        self._track = AxisFilter()
        self._track.reset(seen.range, RANGE_RATE_STD)

    def pass_time(self, period: float) -> None:
        """Predict the range over a period [s]."""
        self.unseen += period
        self._track.predict(0.0, RANGE_ACCELERATION_STD, period)

    def measure(self, seen: RangeBearing) -> None:
        """Take in a measurement, unless its range is an outlier."""
        variance = float(seen.covariance[0, 0])
        error = seen.range - self._track.position
        if error**2 > GATE**2 * (self._track.position_variance + variance):
            self._n_outliers += 1
            if self._n_outliers <= OUTLIERS_MAX:
                return
            self._track.reset(seen.range, RANGE_RATE_STD)
        self.seen, self.unseen, self._n_outliers = seen, 0.0, 0
        self._track.measure_position(seen.range, variance)

    @property
    def distance_left(self) -> float:
        """How close the two will come if both begin to evade now [m]."""
        closing = max(0.0, -self._track.velocity)
        return self._track.position - closing * REACTION_S - closing**2 / (2.0 * BRAKING)


class Evasion:
    """Decides when a vehicle evades others, and how.

    Args:
        vehicle: nominal.
        period: between two readings [s].
        separation: distances at which an evasion begins and ends.
    """

    def __init__(self, vehicle: VehicleConfig, period: float, separation: SeparationConfig) -> None:
        self._vehicle = vehicle
        self._thrust_min = vehicle.thrust_coefficient * vehicle.rotor_speed_min**2
        self._thrust_max = vehicle.thrust_coefficient * vehicle.rotor_speed_max**2
        self._period = period
        self._separation = separation
        self._neighbours: dict[str, _Neighbour] = {}
        """Those in view, or lately so, by name."""
        self._evaded: set[str] = set()
        """Those that are too close, or were and are not far enough yet."""
        self._upwards = 0.0
        """Acceleration of the evasion [m/s^2]."""
        self._upright = 1.0
        """Cosine of the tilt."""

    @property
    def is_needed(self) -> bool:
        """Whether the vehicle should evade another one in the present interval."""
        return bool(self._evaded)

    def sense(self, readings: Readings) -> None:
        """Take in what was measured at the start of an interval, once per period."""
        for neighbour in self._neighbours.values():
            neighbour.pass_time(self._period)
        for name, seen in readings.neighbours.items():
            self._neighbours.setdefault(name, _Neighbour(seen)).measure(seen)
        for name in [name for name, each in self._neighbours.items() if each.unseen > UNSEEN_MAX_S]:
            del self._neighbours[name]
        left = {name: neighbour.distance_left for name, neighbour in self._neighbours.items()}
        self._evaded &= left.keys()
        self._evaded |= {name for name, distance in left.items() if distance < self._separation.emergency}
        self._evaded -= {name for name, distance in left.items() if distance > self._separation.warning}
        if self._evaded:
            nearest = min(sorted(self._evaded), key=left.__getitem__)
            self._upwards = self._acceleration(readings, nearest)
            self._upright = max(float(up_direction(readings.imu.q_NB)[2]), TILT_COSINE_MIN)

    def rotor_speeds(self, planned: Array) -> Array:
        """Rotor speeds of the evasion.

        Args:
            planned: what the vehicle would fly else: front, left, back, right [rad/s], shape (4,).
        Returns:
            The same torques with the thrust of the evasion, as far as the limits allow, shape (4,).
        """
        thrusts = self._vehicle.thrust_coefficient * np.square(planned)
        torques = thrusts - thrusts.mean()
        mean = self._vehicle.mass * (GRAVITY + self._upwards) / (4.0 * self._upright)
        mean = min(mean, self._thrust_max - torques.max())
        mean = max(mean, self._thrust_min - torques.min())
        evading: Array = np.sqrt(
            np.clip(mean + torques, self._thrust_min, self._thrust_max) / self._vehicle.thrust_coefficient
        )
        return evading

    def _acceleration(self, readings: Readings, name: str) -> float:
        """Vertical acceleration away from a neighbour [m/s^2]."""
        up_B = up_direction(readings.imu.q_NB)
        speed = (
            SPEED
            if rises(self._neighbours[name].seen, up_B, is_first=name not in readings.sights)
            else -SPEED
        )
        if readings.sonar.range < HEIGHT_MIN:
            speed = max(0.0, speed)
        return GAIN * (speed - float(up_B @ readings.optic_flow.v_NB_B))


def rises(seen: RangeBearing, up_B: Array, *, is_first: bool) -> bool:
    """Whether a vehicle rises to evade another one; the other one then sinks, by the same rule.

    Args:
        seen: the other one.
        up_B: the vertical in the body frame, shape (3,).
        is_first: whether the vehicle comes before the other one in team order.
    """
    level = math.cos(seen.elevation)
    towards_B = (level * math.cos(seen.azimuth), level * math.sin(seen.azimuth), math.sin(seen.elevation))
    return float(up_B @ towards_B) < (SAME_HEIGHT if is_first else -SAME_HEIGHT)
