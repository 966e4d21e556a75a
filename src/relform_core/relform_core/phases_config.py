"""Schema of the phases of a scenario: motions of the leader and formations."""

from collections.abc import Sequence
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from relform_core.paths_config import Circle, FigureEight, Waypoints
from relform_core.recorded_path_config import RecordedPath
from relform_core.schema import Label, Name, NonNegative, Positive, Schema
from relform_core.units import DEGREES


class Hover(Schema):
    """Slow down to rest over ``ramp`` and stay."""

    kind: Literal["hover"]
    ramp: Annotated[NonNegative, Field(alias="ramp_s")]


class Straight(Schema):
    """Fly along the heading; the speed changes to ``speed`` over ``ramp``."""

    kind: Literal["straight"]
    speed: Annotated[NonNegative, Field(alias="speed_m_s")]
    ramp: Annotated[NonNegative, Field(alias="ramp_s")]


class Turn(Schema):
    """Turn by ``angle`` (positive: to the left) within ``turn`` at constant speed, then fly straight."""

    kind: Literal["turn"]
    angle: Annotated[float, Field(alias="angle_deg", ge=-360.0, le=360.0), DEGREES]
    turn: Annotated[Positive, Field(alias="turn_s")]


class Spiral(Schema):
    """Circle at ``radius`` (positive: to the left) while climbing; ``speed`` includes the climb."""

    kind: Literal["spiral"]
    radius: Annotated[float, Field(alias="radius_m")]
    speed: Annotated[Positive, Field(alias="speed_m_s")]
    climb: Annotated[float, Field(alias="climb_m_s")]
    ramp: Annotated[NonNegative, Field(alias="ramp_s")]

    @model_validator(mode="after")
    def _possible(self) -> Self:
        if abs(self.radius) < 0.1:
            raise ValueError(f"radius_m must be at least 0.1 in magnitude (got {self.radius})")
        if abs(self.climb) >= self.speed:
            raise ValueError(f"climb_m_s {self.climb} must be less than speed_m_s {self.speed} in magnitude")
        return self


LeaderPath = Circle | FigureEight | Waypoints | RecordedPath
Motion = Annotated[Hover | Straight | Turn | Spiral | LeaderPath, Field(discriminator="kind")]


class PhaseConfig(Schema):
    """A part of the flight with one motion of the leader and one formation. The yaw follows the heading."""

    name: Label
    title: Label
    duration: Annotated[Positive, Field(alias="duration_s")]
    steady_from: Annotated[NonNegative, Field(alias="steady_from_s")]
    """Start of the steady-state window that is scored, from the start of the phase [s]."""
    formation: Name
    formation_step: bool = False
    """Whether a new formation applies in one step, as in the paper; else, and where vehicles would have to
    fly through each other, it is blended in within the bounds of ``controller.formation_change``."""
    motion: Motion

    @model_validator(mode="after")
    def _window(self) -> Self:
        if self.steady_from >= self.duration:
            raise ValueError(f"steady_from_s {self.steady_from} must be less than duration_s {self.duration}")
        return self

    @model_validator(mode="after")
    def _path_fits(self) -> Self:
        if isinstance(self.motion, LeaderPath) and self.motion.time > self.duration + 1e-9:
            raise ValueError(
                f"motion '{self.motion.kind}' takes {self.motion.time:.3f} s from rest to rest, "
                f"more than duration_s {self.duration}"
            )
        return self


def path_from_motion(phases: Sequence[PhaseConfig]) -> PhaseConfig | None:
    """The first phase whose path would have to start while the leader moves; None if all start at rest."""
    at_rest = True
    for phase in phases:
        match phase.motion:
            case Circle() | FigureEight() | Waypoints() | RecordedPath():
                if not at_rest:
                    return phase
            case Hover():
                at_rest = at_rest or phase.motion.ramp <= phase.duration
            case Turn():
                at_rest = at_rest and phase.motion.turn <= phase.duration
            case Straight() | Spiral():
                at_rest = False
    return None
