"""Schema of the phases of a scenario: motions of the leader and formations."""

from collections.abc import Sequence
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from relform_core.paths_config import RADIUS_MIN, Circle, FigureEight, Waypoints
from relform_core.recorded_path_config import RecordedPath
from relform_core.schema import Label, Magnitude, Name, NonNegative, Positive, Schema
from relform_core.units import DEGREES


class Hover(Schema):
    """Slow down to rest and stay."""

    kind: Literal["hover"]
    ramp: Annotated[NonNegative, Field(alias="ramp_s", examples=[1.0])]
    """Time in which the leader slows down."""


class Straight(Schema):
    """Fly along the heading."""

    kind: Literal["straight"]
    speed: Annotated[NonNegative, Field(alias="speed_m_s", examples=[2.0])]
    """Speed after the ramp."""
    ramp: Annotated[NonNegative, Field(alias="ramp_s", examples=[1.5])]
    """Time in which the speed changes."""


class Turn(Schema):
    """Turn at constant speed, or on the spot, then fly straight."""

    kind: Literal["turn"]
    angle: Annotated[float, Field(alias="angle_deg", ge=-360.0, le=360.0, examples=[90.0]), DEGREES]
    """Angle of the turn; positive is to the left."""
    turn: Annotated[Positive, Field(alias="turn_s", examples=[0.5])]
    """Time of the turn."""


class Spiral(Schema):
    """Circle while climbing."""

    kind: Literal["spiral"]
    radius: Annotated[float, Field(alias="radius_m", examples=[2.0]), Magnitude(RADIUS_MIN)]
    """Radius of the circle; positive is to the left."""
    speed: Annotated[Positive, Field(alias="speed_m_s", examples=[1.9])]
    """Speed after the ramp, climb included."""
    climb: Annotated[float, Field(alias="climb_m_s", examples=[0.4])]
    """Vertical speed after the ramp, less than ``speed_m_s`` in magnitude; negative: descend."""
    ramp: Annotated[NonNegative, Field(alias="ramp_s", examples=[1.0])]
    """Time in which speed, climb and turn rate change."""

    @model_validator(mode="after")
    def _possible(self) -> Self:
        if abs(self.climb) >= self.speed:
            raise ValueError(f"climb_m_s {self.climb} must be less than speed_m_s {self.speed} in magnitude")
        return self


LeaderPath = Circle | FigureEight | Waypoints | RecordedPath
Motion = Annotated[Hover | Straight | Turn | Spiral | LeaderPath, Field(discriminator="kind")]


class PhaseConfig(Schema):
    """A part of the flight with one motion of the leader and one formation. The yaw follows the heading."""

    name: Annotated[Label, Field(examples=["B"])]
    """Name of the phase, unique in the scenario."""
    title: Annotated[Label, Field(examples=["straight line"])]
    """What happens, for people to read."""
    duration: Annotated[Positive, Field(alias="duration_s", examples=[5.0])]
    """Length of the phase, a multiple of ``controller.period_s``."""
    steady_from: Annotated[NonNegative, Field(alias="steady_from_s", examples=[2.5])]
    """Start of the steady-state window that is scored, from the start of the phase; less than its length."""
    formation: Annotated[Name, Field(examples=["initial"])]
    """Name of the formation, one of ``formations_m``."""
    formation_step: bool = False
    """Whether a new formation applies in one step, as in the paper; else, and where vehicles would have to
    fly through each other, it is blended in within the bounds of ``controller.formation_change``."""
    motion: Motion
    """What the leader flies."""

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
