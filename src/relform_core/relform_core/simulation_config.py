"""Schema of what only a simulated flight has: how motion is integrated, and how nodes keep in step."""

from typing import Annotated, Literal

from pydantic import Field

from relform_core.schema import NonNegative, NonNegativeVector3, Positive, Schema


class PlantConfig(Schema):
    """Integration of the true motion of the vehicles."""

    step: Annotated[float, Field(alias="step_s", gt=0.0, le=0.005)]
    rotor_time_constant: Annotated[NonNegative | None, Field(alias="rotor_time_constant_s")] = None
    """True lag of the rotors [s]; null: that of the vehicle's configuration, which the controller knows."""
    drag_coefficient: Annotated[NonNegativeVector3 | None, Field(alias="drag_coefficient_n_s_m")] = None
    """True linear drag along body x, y, z [N s/m]; null likewise."""


class LockstepConfig(Schema):
    """The barrier that keeps all nodes in the same step."""

    step_timeout: Annotated[Positive, Field(alias="step_timeout_s")]
    """Wall time that the slowest member may take for one step before the flight ends [s]."""
    on_vehicle_lost: Literal["abort"]
