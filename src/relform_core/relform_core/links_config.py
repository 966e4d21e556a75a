"""Schema of the section ``links`` of a scenario: the radio links between each vehicle and the controller."""

from typing import Annotated, Self

from pydantic import Field, model_validator

from relform_core.schema import NonNegative, Positive, Probability, Schema

DELAY_MAX = 1.0
"""Bound on delay and jitter [s]; far beyond what a formation can be flown with."""

Delay = Annotated[float, Field(ge=0.0, le=DELAY_MAX)]


class DirectionConfig(Schema):
    """One direction of every link. All that a vehicle sends at one instant travels in one packet."""

    loss_probability: Annotated[Probability, Field(examples=[0.05])] = 0.0
    """Probability that a packet is lost, independent of the others."""
    burst: Annotated[NonNegative, Field(alias="burst_s", examples=[0.5])] = 0.0
    """Length of each burst, in which every packet is lost; 0: there are none."""
    burst_interval: Annotated[Positive | None, Field(alias="burst_interval_s", examples=[10.0])] = None
    """Mean time from the end of a burst to the start of the next, exponentially distributed; null if
    ``burst_s`` is 0, and only then."""
    delay: Annotated[Delay, Field(alias="delay_s", examples=[0.05])] = 0.0
    """Time from sending to arrival; a packet is received at the first control instant after it."""
    jitter: Annotated[Delay, Field(alias="jitter_s", examples=[0.02])] = 0.0
    """Further delay of each packet, uniform between 0 and this; packets may overtake each other."""

    @property
    def delay_max(self) -> float:
        """The longest delay of a packet [s]."""
        return self.delay + self.jitter

    @model_validator(mode="after")
    def _bursts_complete(self) -> Self:
        if (self.burst > 0.0) != (self.burst_interval is not None):
            raise ValueError(
                f"burst_s {self.burst} and burst_interval_s {self.burst_interval}: give both, or none"
            )
        return self


PERFECT = DirectionConfig()


class LinksConfig(Schema):
    """Both directions, equal for all vehicles; events of the kind ``link`` add to those of one vehicle."""

    up: DirectionConfig = PERFECT
    """From the vehicles to the controller."""
    down: DirectionConfig = PERFECT
    """From the controller to the vehicles. The controller knows the longest delay and plans for it."""

    @property
    def are_perfect(self) -> bool:
        """Whether every packet arrives at the instant at which it is sent."""
        return self.up == self.down == PERFECT
