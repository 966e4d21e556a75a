"""sensor_msgs/Range: height above ground."""

import math
from collections.abc import Collection

from sensor_msgs.msg import Range as RangeMsg

from relform_core.sensors.sonar import Sonar
from relform_ros.fields import MAGNITUDE_MAX, body_frame, header_from_msg, header_to_msg
from relform_ros.rejection import Reason, RejectionError

MESSAGE = RangeMsg


def to_msg(sonar: Sonar, vehicle: str) -> RangeMsg:
    """Height above ground of a vehicle; the message is in float32, and so are the values of ``Sonar``."""
    return RangeMsg(
        header=header_to_msg(sonar.stamp_ns, body_frame(vehicle)),
        radiation_type=RangeMsg.ULTRASOUND,
        field_of_view=sonar.field_of_view,
        min_range=sonar.range_min,
        max_range=sonar.range_max,
        range=sonar.range,
    )


def from_msg(msg: RangeMsg, vehicle: str, team: Collection[str]) -> Sonar:
    """Height above ground of a vehicle; infinite ranges mean out of range (REP-117).

    Raises:
        RejectionError: the message cannot be used, see ``fields``.
    """
    stamp_ns = header_from_msg(msg.header, body_frame(vehicle))
    for what in ("field_of_view", "min_range", "max_range"):
        if not 0.0 <= getattr(msg, what) < math.inf:
            raise RejectionError(
                Reason.INVALID, f"{what} must be finite and not negative (got {getattr(msg, what)})"
            )
    if not (math.isinf(msg.range) or 0.0 <= msg.range <= MAGNITUDE_MAX):
        raise RejectionError(
            Reason.INVALID, f"range must be infinite, or 0 to {MAGNITUDE_MAX:g} m (got {msg.range})"
        )
    return Sonar(
        stamp_ns=stamp_ns,
        range=msg.range,
        range_min=msg.min_range,
        range_max=msg.max_range,
        field_of_view=msg.field_of_view,
    )
