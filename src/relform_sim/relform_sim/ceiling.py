"""Keeps a vehicle below the greatest height of the geofence, by its own sonar."""

from relform_core.geofence_config import GeofenceConfig
from relform_sim.pilot import Readings
from relform_sim.tilt_control import up_direction

WITNESSES = 2
"""Readings in a row that must be too high: one alone may be wrong."""
REACTION_S = 0.1
"""Time from a measurement to the thrust that answers it [s]."""
BRAKING = 6.0
"""Acceleration with which a climb ends [m/s^2]."""
RETURN_GAIN = 1.0
"""Speed downwards per height that is too much [1/s]."""
SPEED_MAX = 1.0
"""Bound on it [m/s]."""


class Ceiling:
    """Ends the climb of a vehicle that would get too high, and asks for a way down (``Guard``).

    Args:
        fence: with the greatest height.
    """

    def __init__(self, fence: GeofenceConfig) -> None:
        self._height_max = fence.height_max
        self._n_too_high = 0
        self.climb: float | None = None
        """See ``Guard``."""

    def sense(self, readings: Readings) -> None:
        """See ``Guard``."""
        excess = readings.sonar.range - self._height_max
        climb = max(0.0, float(up_direction(readings.imu.q_NB) @ readings.optic_flow.v_NB_B))
        is_too_high = excess + climb * REACTION_S + climb**2 / (2.0 * BRAKING) > 0.0
        self._n_too_high = self._n_too_high + 1 if is_too_high else 0
        self.climb = None
        if self._n_too_high >= WITNESSES:
            self.climb = -max(0.0, min(SPEED_MAX, RETURN_GAIN * excess))
