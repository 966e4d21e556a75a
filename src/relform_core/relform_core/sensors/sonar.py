"""Height above ground."""

from dataclasses import dataclass
from typing import Annotated, Self

from pydantic import Field, model_validator

from relform_core.schema import NonNegative, Positive
from relform_core.sensors.sensor import Sensor, SensorConfig
from relform_core.units import DEGREES


class SonarConfig(SensorConfig):
    """Height above ground."""

    range_std: Annotated[NonNegative, Field(alias="range_std_m", examples=[0.02])]
    """Standard deviation of the noise of the measured height."""
    range_min: Annotated[NonNegative, Field(alias="range_min_m", examples=[0.2])]
    """Smallest height that is measured; less than ``range_max_m``."""
    range_max: Annotated[Positive, Field(alias="range_max_m", examples=[10.0])]
    """Largest height that is measured."""
    field_of_view: Annotated[
        float, Field(alias="field_of_view_deg", gt=0.0, lt=180.0, examples=[30.0]), DEGREES
    ]
    """Opening angle of the sonar's cone. Messages report it; the model measures straight down."""

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if self.range_min >= self.range_max:
            raise ValueError(f"range_min_m {self.range_min} must be less than range_max_m {self.range_max}")
        return self


@dataclass(frozen=True)
class Sonar:
    """sensor_msgs/Range (REP-117: +inf beyond range_max, -inf below range_min), in float32 precision."""

    stamp_ns: int
    range: float
    """Height above ground [m]."""
    range_min: float
    range_max: float
    field_of_view: float
    """[rad]."""


SONAR = Sensor("sonar", Sonar, SonarConfig, stream=3)
