"""relform_msgs/FlightStatus: what a vehicle is doing."""

from collections.abc import Collection

from relform_core.flight_modes import VehicleMode
from relform_core.sensors.flight_status import FlightStatus
from relform_msgs.msg import FlightStatus as FlightStatusMsg
from relform_ros.fields import body_frame, header_from_msg, header_to_msg, number_from_msg

MESSAGE = FlightStatusMsg


def to_msg(status: FlightStatus, vehicle: str) -> FlightStatusMsg:
    """What a vehicle is doing."""
    return FlightStatusMsg(
        header=header_to_msg(status.stamp_ns, body_frame(vehicle)), mode=status.mode, reason=status.reason
    )


def from_msg(msg: FlightStatusMsg, vehicle: str, team: Collection[str]) -> FlightStatus:
    """What a vehicle is doing.

    Raises:
        RejectionError: another frame, no valid stamp, or an unknown mode.
    """
    return FlightStatus(
        stamp_ns=header_from_msg(msg.header, body_frame(vehicle)),
        mode=number_from_msg(VehicleMode, msg.mode, "mode"),
        reason=msg.reason,
    )
