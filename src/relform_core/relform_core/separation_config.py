"""Schema of ``separation``: how the distances of the vehicles are watched in flight."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from relform_core.schema import Positive, Schema


class SeparationConfig(Schema):
    """The distance of every pair of vehicles in flight, and what is done when two come too close."""

    warning: Annotated[Positive, Field(alias="warning_m")] = 0.85
    """Below this distance there is a warning. The places of a formation must be at least as far apart."""
    emergency: Annotated[Positive, Field(alias="emergency_m")] = 0.7
    """Below this distance there is an emergency; more than the collision distance of the vehicle."""
    reaction: Literal["evade", "none"] = "evade"
    """What vehicles do that measure a distance below ``emergency_m``, or would soon. ``evade``: one of them
    rises and the other one sinks, until they are ``warning_m`` apart. ``none``: they fly their commands."""

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if self.emergency >= self.warning:
            raise ValueError(f"emergency_m {self.emergency} must be less than warning_m {self.warning}")
        return self
