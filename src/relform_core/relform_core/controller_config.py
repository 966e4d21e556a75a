"""Schema of ``config/controller/*.yaml``: the optimal control problem and how it is solved."""

from typing import Annotated, Literal

from pydantic import Field

from relform_core.schema import NonNegative, Positive, Schema
from relform_core.units import DEGREES


class WeightsConfig(Schema):
    """Weights of eqs. CostFunc1 and CostFunc2, each on the squared norm of its term."""

    formation: Annotated[Positive, Field(alias="formation_per_m2")]
    """Each ordered pair, relative position in {mc_i}."""
    leader_position: Annotated[NonNegative, Field(alias="leader_position_per_m2")]
    leader_yaw: Annotated[NonNegative, Field(alias="leader_yaw_per_rad2")]
    acceleration: Annotated[Positive, Field(alias="acceleration_per_m2_s4")]
    """Net force divided by mass, zero at hover."""
    torque: Annotated[NonNegative, Field(alias="torque_per_n2_m2")]
    thrust_rate: Annotated[NonNegative, Field(alias="thrust_rate_per_n2")]
    """Change of each rotor's thrust from one interval to the next; not in the paper, 0 leaves it out."""
    terminal_scale: Positive
    """Factor on the formation, position and yaw terms of the terminal cost."""


WarmStart = Literal["transform", "shift", "hold", "cold"]
"""The guess of the next control step: the plan shifted in time and transformed into the next {mi} frames, as
in the paper; only shifted; held as it is; or none, a hover from the measured states. The last three are there
to show what they cost."""

FormationPairs = Literal["all", "with_leader", "one_way"]
"""Ordered pairs in the formation cost: all, as in the paper; those without the branches between followers; or
each pair once, from the vehicle that comes first in team order. The last two are there to show what they
cost."""


class SolverConfig(Schema):
    """Limits of the modified real-time iteration (Algorithm MRTI)."""

    kkt_tolerance_start: Positive
    sqp_steps_start_max: Annotated[int, Field(ge=1, le=1000)]
    kkt_tolerance: Positive
    sqp_steps_max: Annotated[int, Field(ge=1, le=100)]
    warm_start: WarmStart


class ControllerConfig(Schema):
    """The formation controller."""

    period: Annotated[float, Field(alias="period_s", gt=0.0, le=1.0)]
    """Control period, and length of one interval of the horizon [s]."""
    horizon_steps: Annotated[int, Field(ge=2, le=100)]
    formation_pairs: FormationPairs
    weights: WeightsConfig
    solver: SolverConfig
    relative_yaw_std_max: Annotated[float, Field(alias="relative_yaw_std_max_deg", gt=0.0, le=90.0), DEGREES]
    """Beyond this standard deviation eq. YawEst5 counts as singular and the yaw is propagated with the
    gyros."""
    formation_ramp: Annotated[NonNegative, Field(alias="formation_ramp_s")]
    """Time over which a new formation reference is blended in [s]; 0: a step, as in the paper."""
