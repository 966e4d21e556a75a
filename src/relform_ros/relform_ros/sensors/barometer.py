"""sensor_msgs/FluidPressure: air pressure."""

import math
from collections.abc import Collection

from sensor_msgs.msg import FluidPressure as FluidPressureMsg

from relform_core.sensors.barometer import AirPressure
from relform_ros.fields import body_frame, header_from_msg, header_to_msg
from relform_ros.rejection import Reason, RejectionError

MESSAGE = FluidPressureMsg


def to_msg(measurement: AirPressure, vehicle: str) -> FluidPressureMsg:
    """Air pressure at a vehicle."""
    return FluidPressureMsg(
        header=header_to_msg(measurement.stamp_ns, body_frame(vehicle)),
        fluid_pressure=measurement.pressure,
        variance=measurement.variance,
    )


def from_msg(msg: FluidPressureMsg, vehicle: str, team: Collection[str]) -> AirPressure:
    """Air pressure at a vehicle.

    Raises:
        RejectionError: another frame, no valid stamp, a pressure that is not positive or a negative variance.
    """
    stamp_ns = header_from_msg(msg.header, body_frame(vehicle))
    if not 0.0 < msg.fluid_pressure < math.inf:
        raise RejectionError(
            Reason.INVALID, f"fluid_pressure must be positive and finite (got {msg.fluid_pressure} Pa)"
        )
    if not 0.0 <= msg.variance < math.inf:
        raise RejectionError(
            Reason.INVALID, f"variance must be finite and not negative (got {msg.variance} Pa^2)"
        )
    return AirPressure(stamp_ns=stamp_ns, pressure=msg.fluid_pressure, variance=msg.variance)
