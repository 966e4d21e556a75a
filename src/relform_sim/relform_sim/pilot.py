"""What flies a vehicle on its own sensors."""

from collections.abc import Mapping
from typing import NamedTuple, Protocol

from relform_core.arrays import Array
from relform_core.flight_modes import VehicleMode
from relform_core.sensors.imu import Imu
from relform_core.sensors.optic_flow import OpticFlow
from relform_core.sensors.range_bearing import RangeBearing
from relform_core.sensors.sonar import Sonar


class Readings(NamedTuple):
    """What the vehicle measures of itself at the start of an interval."""

    imu: Imu
    optic_flow: OpticFlow
    sonar: Sonar
    sights: Mapping[str, RangeBearing] = {}
    """Of neighbours that may serve as landmarks, by name."""
    place_N: Array | None = None
    """Position by the localization [m], shape (3,); None: it was not measured, or the vehicle has none."""
    neighbours: Mapping[str, RangeBearing] = {}
    """Of all neighbours in view, by name."""


class Guard(Protocol):
    """What changes the vertical speed of a vehicle, whatever flies it."""

    climb: float | None
    """Vertical speed that it asks for in the present interval [m/s]; None: it asks for nothing."""

    def sense(self, readings: Readings) -> None:
        """Take in what was measured at the start of an interval, once per interval."""


class Pilot(Protocol):
    """Flies those modes that the controller does not fly."""

    failsafe_speed: float
    """Vertical speed in FAILSAFE, downwards [m/s]; may be changed."""
    is_up: bool
    """Whether the vehicle has reached the height of take-off."""
    is_down: bool
    """Whether the vehicle is on the ground."""

    def sense(self, readings: Readings, mode: VehicleMode, applied: Array) -> None:
        """Take in what was measured, once per interval and before its mode is known.

        Args:
            readings: at the start of the interval.
            mode: of the interval before.
            applied: rotor speeds of the interval before [rad/s], shape (4,).
        """

    def rotor_speeds(self, mode: VehicleMode) -> Array:
        """Fly the interval in a mode.

        Returns:
            Rotor speeds front, left, back, right, possibly beyond the limits [rad/s], shape (4,).
        """
