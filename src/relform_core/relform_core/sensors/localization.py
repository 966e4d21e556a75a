"""Position, velocity and yaw in the world frame; only the leader has it."""

from typing import Annotated

from pydantic import Field

from relform_core.measurements import Odometry
from relform_core.schema import Positive
from relform_core.sensors.sensor import Sensor, SensorConfig
from relform_core.units import DEGREES


class LocalizationConfig(SensorConfig):
    """Position, velocity and yaw in the world frame; only the leader has it."""

    position_std: Annotated[Positive, Field(alias="position_std_m")]
    velocity_std: Annotated[Positive, Field(alias="velocity_std_m_s")]
    yaw_std: Annotated[float, Field(alias="yaw_std_deg", gt=0.0, le=180.0), DEGREES]


LOCALIZATION = Sensor("localization", Odometry, LocalizationConfig, stream=5, leader_only=True)
