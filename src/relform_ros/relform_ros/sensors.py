"""How each sensor's measurement travels: its message and the conversions, by the name of the sensor."""

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from typing import Any

from geometry_msgs.msg import TwistWithCovarianceStamped
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Imu, Range

from relform_core.scenario_config import SensorName, TeamConfig
from relform_core.sensors.imu import IMU
from relform_core.sensors.localization import LOCALIZATION
from relform_core.sensors.optic_flow import OPTIC_FLOW
from relform_core.sensors.range_bearing import RANGE_BEARING
from relform_core.sensors.sensor import Sensor
from relform_core.sensors.sonar import SONAR
from relform_msgs.msg import RangeBearingArray
from relform_ros import conversions


@dataclass(frozen=True)
class SensorWire:
    """One sensor on the wire."""

    sensor: Sensor[Any, Any]
    message: type[Any]
    to_msg: Callable[[Any, str], Any]
    """Measurement and vehicle to message."""
    from_msg: Callable[[Any, str, Collection[str]], Any]
    """Message, vehicle and team to measurement; raises RejectionError."""


def _alone(from_msg: Callable[[Any, str], Any]) -> Callable[[Any, str, Collection[str]], Any]:
    """Conversion of a sensor that does not see the others."""
    return lambda msg, vehicle, team: from_msg(msg, vehicle)


SENSORS: Mapping[SensorName, SensorWire] = {
    "imu": SensorWire(IMU, Imu, conversions.imu_to_msg, _alone(conversions.imu_from_msg)),
    "optic_flow": SensorWire(
        OPTIC_FLOW,
        TwistWithCovarianceStamped,
        conversions.optic_flow_to_msg,
        _alone(conversions.optic_flow_from_msg),
    ),
    "sonar": SensorWire(SONAR, Range, conversions.sonar_to_msg, _alone(conversions.sonar_from_msg)),
    "range_bearing": SensorWire(
        RANGE_BEARING,
        RangeBearingArray,
        conversions.range_bearings_to_msg,
        conversions.range_bearings_from_msg,
    ),
    "localization": SensorWire(
        LOCALIZATION, Odometry, conversions.odometry_to_msg, _alone(conversions.odometry_from_msg)
    ),
}
"""In the order in which a vehicle sends them."""


def sensors_of(vehicle: str, team: TeamConfig) -> tuple[SensorName, ...]:
    """Names of the sensors that a vehicle carries; only the leader has a localization."""
    return tuple(name for name in SENSORS if name != "localization" or vehicle == team.leader)
