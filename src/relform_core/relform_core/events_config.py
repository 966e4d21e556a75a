"""Schema of the events of a scenario: what disturbs one vehicle for some time."""

from typing import TYPE_CHECKING, Annotated, Literal, Self

from pydantic import Field, model_validator

from relform_core.schema import Name, NonNegative, Positive, Probability, Schema, Vector3
from relform_core.sensors.registry import SENSORS
from relform_core.units import DEGREES

if TYPE_CHECKING:
    SensorName = str
else:
    SensorName = Literal[tuple(sensor.name for sensor in SENSORS)]


class _Event(Schema):
    """A disturbance of one vehicle between two instants, in seconds from the start of the flight."""

    start: Annotated[NonNegative, Field(alias="start_s")]
    end: Annotated[Positive, Field(alias="end_s")]
    target: Name

    def active(self, time: float) -> bool:
        """Whether the event acts at ``time`` [s]."""
        return self.start <= time < self.end

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if self.start >= self.end:
            raise ValueError(f"start_s {self.start} must be less than end_s {self.end}")
        return self


class Wind(_Event):
    """A constant force on the vehicle."""

    kind: Literal["wind"]
    force_N: Annotated[Vector3, Field(alias="force_n")]
    """In the world frame {n} [N]."""


class ThrustScale(_Event):
    """Every rotor's thrust and torque is multiplied by ``scale``."""

    kind: Literal["thrust_scale"]
    scale: Annotated[float, Field(gt=0.0, le=2.0)]


class Outliers(_Event):
    """Measured ranges and bearings are replaced by wrong ones with this probability."""

    kind: Literal["outliers"]
    probability: Probability
    range_std: Annotated[Positive, Field(alias="range_std_m")]
    bearing_std: Annotated[float, Field(alias="bearing_std_deg", gt=0.0, le=180.0), DEGREES]


class Dropout(_Event):
    """Messages of one sensor are not sent with this probability."""

    kind: Literal["dropout"]
    sensor: SensorName
    probability: Probability


class CommandLoss(_Event):
    """Commands do not reach the vehicle with this probability."""

    kind: Literal["command_loss"]
    probability: Probability


Event = Annotated[Wind | ThrustScale | Outliers | Dropout | CommandLoss, Field(discriminator="kind")]
