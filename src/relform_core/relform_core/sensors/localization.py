"""Position, velocity and yaw in the world frame; only the leader has it."""

from typing import Annotated

from pydantic import Field

from relform_core.measurements import Odometry
from relform_core.schema import Positive
from relform_core.sensors.sensor import Sensor, SensorConfig
from relform_core.units import DEGREES


class LocalizationConfig(SensorConfig):
    """Position, velocity and yaw in the world frame; only the leader has it."""

    position_std: Annotated[Positive, Field(alias="position_std_m", examples=[0.02])]
    """Standard deviation of the noise of the position along each world axis."""
    velocity_std: Annotated[Positive, Field(alias="velocity_std_m_s", examples=[0.1])]
    """Standard deviation of the noise of the velocity along each axis."""
    yaw_std: Annotated[float, Field(alias="yaw_std_deg", gt=0.0, le=180.0, examples=[0.005]), DEGREES]
    """Standard deviation of the noise of the yaw."""


LOCALIZATION = Sensor("localization", Odometry, LocalizationConfig, stream=5, leader_only=True)
