"""Schema of the events of a scenario: what disturbs one vehicle for some time."""

from typing import TYPE_CHECKING, Annotated, Literal, Self

from pydantic import Field, model_validator

from relform_core.links_config import Delay
from relform_core.schema import Name, NonNegative, Positive, Probability, Schema, Vector3
from relform_core.sensors.registry import SENSORS
from relform_core.units import DEGREES, PERCENT

if TYPE_CHECKING:
    SensorName = str
else:
    SensorName = Literal[tuple(sensor.name for sensor in SENSORS)]


class _Event(Schema):
    """A disturbance of one vehicle between two instants, in seconds from the start of the flight."""

    start: Annotated[NonNegative, Field(alias="start_s", examples=[3.5])]
    """Start of the event, from the start of the flight."""
    end: Annotated[Positive, Field(alias="end_s", examples=[4.5])]
    """End of the event; greater than ``start_s``."""
    target: Annotated[Name, Field(examples=["follower_1"])]
    """Name of the vehicle."""

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
    force_N: Annotated[Vector3, Field(alias="force_n", examples=[[0.0, 3.5, 0.0]])]
    """The force in the world frame {n}."""


class ThrustLoss(_Event):
    """What changes the thrust of the rotors."""

    def scale_at(self, time: float) -> float:
        """Factor on thrust and torque of every rotor at a time [s]."""
        return 1.0

    @property
    def rotor_scales(self) -> tuple[float, float, float, float]:
        """A further one for the rotors front, left, back, right."""
        return (1.0, 1.0, 1.0, 1.0)


class ThrustScale(ThrustLoss):
    """Every rotor's thrust and torque is multiplied by a factor."""

    kind: Literal["thrust_scale"]
    scale: Annotated[float, Field(gt=0.0, le=2.0, examples=[0.9])]
    """The factor; 0.9 is a loss of ten percent."""

    def scale_at(self, time: float) -> float:
        """See ``ThrustLoss``."""
        return self.scale


class ThrustDecay(ThrustLoss):
    """Every rotor's thrust and torque falls slowly, as with a battery that gets empty."""

    kind: Literal["thrust_decay"]
    rate: Annotated[float, Field(alias="rate_percent_s", gt=0.0, le=100.0, examples=[1.0]), PERCENT]
    """How much of the full thrust is lost per second."""
    floor: Annotated[float, Field(alias="floor_percent", gt=0.0, lt=100.0), PERCENT] = 50.0
    """Part of the full thrust that always remains."""

    def scale_at(self, time: float) -> float:
        """See ``ThrustLoss``."""
        return max(self.floor, 1.0 - self.rate * (time - self.start))


class WeakRotor(ThrustLoss):
    """One rotor's thrust and torque is multiplied by a factor."""

    kind: Literal["weak_rotor"]
    rotor: Annotated[Literal["front", "left", "back", "right"], Field(examples=["left"])]
    """Which one."""
    scale: Annotated[float, Field(ge=0.0, le=1.0, examples=[0.8])]
    """The factor; 0.8 is a loss of twenty percent, 0 stops the rotor."""

    @property
    def rotor_scales(self) -> tuple[float, float, float, float]:
        """See ``ThrustLoss``."""
        front, left, back, right = (
            self.scale if self.rotor == name else 1.0 for name in ("front", "left", "back", "right")
        )
        return front, left, back, right


class Outliers(_Event):
    """Measured ranges and bearings are replaced by wrong ones."""

    kind: Literal["outliers"]
    probability: Annotated[Probability, Field(examples=[0.05])]
    """Probability that a target's measurement is replaced."""
    range_std: Annotated[Positive, Field(alias="range_std_m", examples=[1.0])]
    """Standard deviation of the error of the range."""
    bearing_std: Annotated[float, Field(alias="bearing_std_deg", gt=0.0, le=180.0, examples=[57.3]), DEGREES]
    """Standard deviation of the errors of azimuth and elevation."""


class Dropout(_Event):
    """Messages of one sensor are not sent."""

    kind: Literal["dropout"]
    sensor: Annotated[SensorName, Field(examples=["optic_flow"])]
    """Name of the sensor, which the vehicle must carry."""
    probability: Annotated[Probability, Field(examples=[0.5])]
    """Probability that a message is not sent."""


class Occlusion(_Event):
    """The vehicle does not see another one."""

    kind: Literal["occlusion"]
    hidden: Annotated[Name, Field(examples=["leader"])]
    """Name of the other vehicle."""


class LocalizationJump(_Event):
    """The localization of the leader is off by a constant."""

    kind: Literal["localization_jump"]
    offset_N: Annotated[Vector3, Field(alias="offset_m", examples=[[0.5, 0.0, 0.0]])]
    """The constant in the world frame {n}."""


class CommandLoss(_Event):
    """Commands do not reach the vehicle."""

    kind: Literal["command_loss"]
    probability: Annotated[Probability, Field(examples=[0.5])]
    """Probability that a command is lost."""


class LinkFault(_Event):
    """Packets between the vehicle and the controller are lost or late, in addition to what ``links`` says."""

    kind: Literal["link"]
    direction: Literal["up", "down", "both"] = "both"
    """``up``: from the vehicle to the controller, ``down``: from the controller to the vehicle."""
    probability: Annotated[Probability, Field(alias="loss_probability", examples=[0.5])] = 0.0
    """Probability that a packet is lost."""
    delay: Annotated[Delay, Field(alias="delay_s", examples=[0.05])] = 0.0
    """Further delay of each packet. The controller does not know it."""
    jitter: Annotated[Delay, Field(alias="jitter_s", examples=[0.02])] = 0.0
    """Further delay of each packet, uniform between 0 and this."""


Event = Annotated[
    Wind
    | ThrustScale
    | ThrustDecay
    | WeakRotor
    | Outliers
    | Dropout
    | Occlusion
    | LocalizationJump
    | CommandLoss
    | LinkFault,
    Field(discriminator="kind"),
]
