"""Schema of the events of a scenario: what disturbs one vehicle for some time."""

from typing import TYPE_CHECKING, Annotated, Literal, Self

from pydantic import Field, model_validator

from relform_core.links_config import Delay
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


class Occlusion(_Event):
    """The vehicle does not see another one."""

    kind: Literal["occlusion"]
    hidden: Name
    """The other vehicle."""


class LocalizationJump(_Event):
    """The localization of the leader is off by a constant."""

    kind: Literal["localization_jump"]
    offset_N: Annotated[Vector3, Field(alias="offset_m")]
    """In the world frame {n} [m]."""


class CommandLoss(_Event):
    """Commands do not reach the vehicle with this probability."""

    kind: Literal["command_loss"]
    probability: Probability


class LinkFault(_Event):
    """Packets between the vehicle and the controller are lost or late, in addition to what ``links`` says."""

    kind: Literal["link"]
    direction: Literal["up", "down", "both"] = "both"
    """``up``: from the vehicle to the controller."""
    probability: Annotated[Probability, Field(alias="loss_probability")] = 0.0
    delay: Annotated[Delay, Field(alias="delay_s")] = 0.0
    """Further delay of each packet [s]. The controller does not know it."""
    jitter: Annotated[Delay, Field(alias="jitter_s")] = 0.0
    """Further delay, uniform between 0 and this [s]."""


Event = Annotated[
    Wind | ThrustScale | Outliers | Dropout | Occlusion | LocalizationJump | CommandLoss | LinkFault,
    Field(discriminator="kind"),
]
