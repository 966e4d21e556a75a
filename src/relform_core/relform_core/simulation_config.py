"""Schema of what only a simulated flight has: how motion is integrated, and how nodes keep in step."""

from typing import Annotated, Literal

from pydantic import Field

from relform_core.schema import NonNegative, NonNegativeVector3, Positive, Schema


class PlantConfig(Schema):
    """Integration of the true motion of the vehicles."""

    step: Annotated[float, Field(alias="step_s", gt=0.0, le=0.005, examples=[0.005])]
    """Length of an integration step; it divides ``controller.period_s``."""
    rotor_time_constant: Annotated[
        NonNegative | None, Field(alias="rotor_time_constant_s", examples=[0.05])
    ] = None
    """True time constant of the rotors; null: that of the vehicle's configuration, which the controller
    knows."""
    drag_coefficient: Annotated[
        NonNegativeVector3 | None, Field(alias="drag_coefficient_n_s_m", examples=[[0.1, 0.1, 0.05]])
    ] = None
    """True linear drag along body x, y, z; null: that of the vehicle's configuration."""


class LockstepConfig(Schema):
    """The barrier that keeps all nodes in the same step."""

    step_timeout: Annotated[Positive, Field(alias="step_timeout_s", examples=[10.0])]
    """Wall time that the slowest node may take for one step before the flight ends."""
    on_vehicle_lost: Annotated[Literal["abort"], Field(examples=["abort"])]
    """What happens when the node of a vehicle ends or stops answering: the flight ends."""
