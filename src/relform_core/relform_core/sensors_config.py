"""Schema of ``config/sensors/*.yaml``: what every vehicle of a team measures, and how badly."""

from relform_core.schema import Schema
from relform_core.sensors.imu import ImuConfig
from relform_core.sensors.localization import LocalizationConfig
from relform_core.sensors.optic_flow import OpticFlowConfig
from relform_core.sensors.range_bearing import RangeBearingConfig
from relform_core.sensors.sonar import SonarConfig


class SensorsConfig(Schema):
    """The sensors of every vehicle of a team."""

    imu: ImuConfig
    optic_flow: OpticFlowConfig
    sonar: SonarConfig
    range_bearing: RangeBearingConfig
    localization: LocalizationConfig
