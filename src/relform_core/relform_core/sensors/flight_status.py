"""What a vehicle of a scenario with take-off and landing is doing, as its onboard logic reports it."""

from dataclasses import dataclass

from relform_core.flight_modes import VehicleMode
from relform_core.sensors.sensor import Source


@dataclass(frozen=True)
class FlightStatus:
    """relform_msgs/FlightStatus: the mode of a vehicle at an instant."""

    stamp_ns: int
    mode: VehicleMode
    reason: str
    """Why it is in this mode, or why it refuses what its controller asks for; for people, may be empty."""


FLIGHT_STATUS = Source("flight_status", FlightStatus)
