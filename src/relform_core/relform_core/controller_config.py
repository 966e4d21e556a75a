"""Schema of ``config/controller/*.yaml``: the optimal control problem and how it is solved."""

from typing import Annotated, Any, Literal, Self

from pydantic import BeforeValidator, ConfigDict, Field, model_validator

from relform_core.constraints_config import ConstraintsConfig
from relform_core.schema import NonNegative, Positive, Schema, by_kind
from relform_core.units import DEGREES

WEIGHT_MAX = 1e6
"""Far above useful weights; squares of such numbers are still finite."""


class WeightsConfig(Schema):
    """Weights of eqs. CostFunc1 and CostFunc2, each on the squared norm of its term.

    They are those of a team of three Hummingbirds; other teams and vehicles scale their terms
    (docs/decisions/0015).
    """

    formation: Annotated[float, Field(alias="formation_per_m2", gt=0.0, le=WEIGHT_MAX, examples=[10.0])]
    """Weight on the error of each ordered pair's relative position in {mc_i}."""
    leader_position: Annotated[
        float, Field(alias="leader_position_per_m2", ge=0.0, le=WEIGHT_MAX, examples=[2.0])
    ]
    """Weight on the leader's distance from its path."""
    leader_yaw: Annotated[float, Field(alias="leader_yaw_per_rad2", ge=0.0, le=WEIGHT_MAX, examples=[3.0])]
    """Weight on the leader's yaw off its heading."""
    acceleration: Annotated[
        float, Field(alias="acceleration_per_m2_s4", gt=0.0, le=WEIGHT_MAX, examples=[0.003])
    ]
    """Weight on the net force divided by mass, zero at hover."""
    torque: Annotated[float, Field(alias="torque_per_n2_m2", ge=0.0, le=WEIGHT_MAX, examples=[40.0])]
    """Weight on the torque of each vehicle."""
    thrust_rate: Annotated[float, Field(alias="thrust_rate_per_n2", ge=0.0, le=WEIGHT_MAX, examples=[0.35])]
    """Weight on the change of each rotor's thrust from one interval to the next. The paper has no such term;
    0 leaves it out."""
    terminal_scale: Annotated[float, Field(gt=0.0, le=WEIGHT_MAX, examples=[8.0])]
    """Factor on the formation, position and yaw terms of the terminal cost."""


WarmStart = Literal["transform", "shift", "hold", "cold"]
FormationPairs = Literal["all", "with_leader", "one_way"]


class RawEstimatorConfig(Schema):
    """Raw feedback: each state is taken from one sensor, as in the paper."""

    kind: Literal["raw"]


class TeamEstimatorConfig(Schema):
    """A Kalman filter of the whole team. The switches exist for ablations."""

    kind: Literal["team"]
    detects_changes: bool = True
    """Whether innovations that contradict the model make forces and torques uncertain again."""
    gates_sightings: bool = True
    """Whether sightings that contradict the belief are rejected."""
    estimates_inertia: bool = True
    """Whether the moments of inertia are part of the state; else their uncertainty is process noise."""
    finds_rotor_lag: bool = True
    """Whether another lag of the rotors than the configured one is found in flight."""


_Estimator = Annotated[RawEstimatorConfig | TeamEstimatorConfig, Field(discriminator="kind")]
EstimatorConfig = Annotated[
    _Estimator, BeforeValidator(by_kind, json_schema_input_type=Literal["raw", "team"] | _Estimator)
]
"""Where the start of the horizon comes from."""


class SolverConfig(Schema):
    """Limits of the modified real-time iteration (Algorithm MRTI)."""

    kkt_tolerance_start: Annotated[Positive, Field(examples=[1.0e-3])]
    """The first decision of a flight takes SQP steps until the KKT value is less than this."""
    sqp_steps_start_max: Annotated[int, Field(ge=1, le=1000, examples=[50])]
    """Largest number of SQP steps of the first decision."""
    kkt_tolerance: Annotated[Positive, Field(examples=[10.0])]
    """Each later decision takes SQP steps until the KKT value is less than this."""
    sqp_steps_max: Annotated[int, Field(ge=1, le=100, examples=[2])]
    """Largest number of SQP steps of each later decision."""
    warm_start: Annotated[WarmStart, Field(examples=["transform"])]
    """The guess from which a decision starts. ``transform``: the last plan, shifted in time and transformed
    into the next frames, as in the paper. ``shift``: the plan, shifted only. ``hold``: the plan as it is.
    ``cold``: a hover from the measured states. The last three exist for ablations."""


class FormationChangeConfig(Schema):
    """Bounds on the motion of each follower relative to the leader while the formation changes."""

    speed_max: Annotated[Positive, Field(alias="speed_max_m_s", examples=[1.0])]
    """Highest speed relative to the leader."""
    acceleration_max: Annotated[Positive, Field(alias="acceleration_max_m_s2", examples=[1.0])]
    """Highest acceleration relative to the leader."""
    margin: Annotated[NonNegative, Field(alias="margin_m", examples=[0.1])] = 0.0
    """On the way, vehicles keep this much more than the collision distance between their references, because
    they are not exactly where they should be. Formations that are closer themselves halve it."""


class LeaderMotionConfig(Schema):
    """Bounds on what the leader may be asked to fly outside the phases of a scenario."""

    speed_max: Annotated[Positive, Field(alias="speed_max_m_s")] = 2.0
    """Highest speed."""
    acceleration_max: Annotated[Positive, Field(alias="acceleration_max_m_s2")] = 2.0
    """Highest acceleration."""
    turn_rate_max: Annotated[float, Field(alias="turn_rate_max_deg_s", gt=0.0, le=360.0), DEGREES] = 90.0
    """Highest rate of the yaw."""


def _one_kind_of_change(schema: dict[str, Any]) -> None:
    """State in the JSON Schema which of two keys must have a value."""
    schema["required"].remove("formation_change")
    schema["oneOf"] = [
        {"required": ["formation_change"], "properties": {"formation_change": {"type": "object"}}},
        {"required": ["formation_ramp_s"], "properties": {"formation_ramp_s": {"type": "number"}}},
    ]


class ControllerConfig(Schema):
    """The formation controller."""

    model_config = ConfigDict(json_schema_extra=_one_kind_of_change)

    period: Annotated[float, Field(alias="period_s", gt=0.0, le=1.0, examples=[0.05])]
    """Time from one command to the next, a multiple of ``plant.step_s``."""
    horizon_steps: Annotated[int, Field(ge=2, le=100, examples=[15])]
    """Number of stages of the horizon."""
    formation_pairs: Annotated[FormationPairs, Field(examples=["all"])]
    """Ordered pairs in the formation cost. ``all``: as in the paper. ``with_leader``: pairs that include the
    leader. ``one_way``: each pair once, observed by the vehicle that comes first in team order. The last two
    exist for ablations."""
    weights: WeightsConfig
    """Weights of the cost."""
    solver: SolverConfig
    """Limits of the solver."""
    relative_yaw_std_max: Annotated[
        float, Field(alias="relative_yaw_std_max_deg", gt=0.0, le=90.0, examples=[20.0]), DEGREES
    ]
    """Above this standard deviation the relative yaw from sightings counts as singular (eq. YawEst5), and
    is propagated with the gyros."""
    formation_change: FormationChangeConfig | None
    """Bounds within which a new formation is blended in, over the shortest time. null together with
    ``formation_ramp_s``."""
    formation_ramp: Annotated[
        NonNegative | None,
        Field(alias="formation_ramp_s", examples=[1.0], json_schema_extra={"deprecated": True}),
    ] = None
    """Only in recordings of older versions, in place of ``formation_change``: every change of formation takes
    this time, 0 is a step, and no change is refused for its path."""
    leader_motion: LeaderMotionConfig = LeaderMotionConfig()
    """Bounds on what the leader may be asked to fly by requests and by paths from files."""
    constraints: ConstraintsConfig = ConstraintsConfig()
    """Soft constraints of the optimal control problem."""
    estimator: Annotated[EstimatorConfig, Field(examples=["team"])] = RawEstimatorConfig(kind="raw")
    """Where the start of the horizon comes from, as a mapping with its ``kind``, or the kind alone."""
    start_wait_max: Annotated[NonNegative, Field(alias="start_wait_max_s")] = 5.0
    """How long the team stays where it is at the start of a flight while the controller waits for a first
    estimate that is accurate enough; then the flight ends."""
    stage: Annotated[float | None, Field(alias="stage_s", gt=0.0, le=1.0, examples=[0.05])] = None
    """Length of one stage of the horizon, at least the control period; null: the control period. The cost
    sums over stages, whatever their length."""

    @property
    def stage_length(self) -> float:
        """Length of one stage of the horizon [s]."""
        return self.period if self.stage is None else self.stage

    @property
    def horizon(self) -> float:
        """Length of the horizon [s]."""
        return self.horizon_steps * self.stage_length

    @model_validator(mode="after")
    def _stage_not_shorter_than_period(self) -> Self:
        if self.stage_length < self.period:
            raise ValueError(f"stage_s {self.stage_length} must be at least period_s {self.period}")
        return self

    @model_validator(mode="before")
    @classmethod
    def _recorded_by_an_older_version(cls, written: Any) -> Any:
        if isinstance(written, dict) and written.get("formation_ramp_s") is not None:
            return {"formation_change": None, **written}
        return written

    @model_validator(mode="after")
    def _one_kind_of_change(self) -> Self:
        if (self.formation_change is None) == (self.formation_ramp is None):
            raise ValueError("exactly one of formation_change and formation_ramp_s must have a value")
        return self
