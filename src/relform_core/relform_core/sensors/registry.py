"""The registration of all sensors."""

from typing import Any

from relform_core.sensors.barometer import BAROMETER
from relform_core.sensors.imu import IMU
from relform_core.sensors.localization import LOCALIZATION
from relform_core.sensors.optic_flow import OPTIC_FLOW
from relform_core.sensors.range_bearing import RANGE_BEARING
from relform_core.sensors.sensor import Sensor
from relform_core.sensors.sonar import SONAR

SENSORS: tuple[Sensor[Any, Any], ...] = (IMU, OPTIC_FLOW, SONAR, RANGE_BEARING, LOCALIZATION, BAROMETER)
"""In the order in which a vehicle sends them. Append a new one."""
