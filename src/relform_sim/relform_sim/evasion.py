"""What a vehicle does on board when another one is too close, by the ranges and bearings that it measures.

Of two vehicles that meet, one rises and the other sinks: the thrust of a quadrotor changes at once, its tilt
does not. The higher one rises; at about the same height, the one that comes first in team order. Each keeps
the torques of what it flies, so that it turns and tilts as its controller, or its pilot, wants.
"""

import math

from relform_core.arrays import Array
from relform_core.sensors.range_bearing import RangeBearing
from relform_core.separation_config import SeparationConfig
from relform_sim.axis_filter import AxisFilter
from relform_sim.pilot import Readings
from relform_sim.tilt_control import up_direction

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
    """Decides when a vehicle evades others, and whether it rises or sinks then (``Guard``).

    Args:
        period: between two readings [s].
        separation: distances at which an evasion begins and ends.
    """

    def __init__(self, period: float, separation: SeparationConfig) -> None:
        self._period = period
        self._separation = separation
        self._neighbours: dict[str, _Neighbour] = {}
        """Those in view, or lately so, by name."""
        self._evaded: set[str] = set()
        """Those that are too close, or were and are not far enough yet."""
        self.climb: float | None = None
        """See ``Guard``."""

    def sense(self, readings: Readings) -> None:
        """See ``Guard``."""
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
        self.climb = None
        if self._evaded:
            nearest = min(sorted(self._evaded), key=left.__getitem__)
            self.climb = self._climb_from(readings, nearest)

    def _climb_from(self, readings: Readings, name: str) -> float:
        """Vertical speed away from a neighbour [m/s]."""
        up_B = up_direction(readings.imu.q_NB)
        if rises(self._neighbours[name].seen, up_B, is_first=name not in readings.sights):
            return SPEED
        return 0.0 if readings.sonar.range < HEIGHT_MIN else -SPEED


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
