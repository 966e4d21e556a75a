"""Schema of the section ``pacing`` of a scenario: when a control step begins."""

from typing import Annotated, Literal

from pydantic import BeforeValidator, Field

from relform_core.schema import Schema, by_kind


class LockstepPacingConfig(Schema):
    """A step begins when all nodes have finished the one before: a flight is the same on any machine."""

    kind: Literal["lockstep"]


class RealTimePacingConfig(Schema):
    """Step k begins k control periods after the first, whatever the nodes do."""

    kind: Literal["real_time"]
    wait_share: Annotated[float, Field(gt=0.0, lt=1.0)] = 0.5
    """Share of the control period that the controller waits at most for the measurements of a step; then it
    decides on what has arrived."""
    solver_share: Annotated[float, Field(gt=0.0, lt=1.0)] = 0.3
    """Share of the control period after which no further SQP step of a decision begins."""
    restarts_max: Annotated[int, Field(ge=0, le=1000)] = 3
    """How often ``fly`` starts a controller again that was killed or has crashed, in one flight."""


_Pacing = Annotated[LockstepPacingConfig | RealTimePacingConfig, Field(discriminator="kind")]
PacingConfig = Annotated[
    _Pacing, BeforeValidator(by_kind, json_schema_input_type=Literal["lockstep", "real_time"] | _Pacing)
]
"""``pacing: real_time`` is short for ``pacing: {kind: real_time}``."""

LOCKSTEP = LockstepPacingConfig(kind="lockstep")
