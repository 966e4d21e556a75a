"""What a controller reports about each control step, holding exactly what its messages hold.

Times are integer nanoseconds of simulation time, everything else is SI and radians. Frames are named in
``relform_core.measurements``; {mc} has the position and the yaw of a body, without its roll and pitch.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Generic, TypeVar

from relform_core.arrays import Array
from relform_core.flight_modes import TeamMode, TeamRequest, VehicleMode
from relform_core.live_values import Value
from relform_core.measurements import RotorCommand
from relform_core.names import EstimatorMode, SeparationLevel, SolverState
from relform_core.schema import Vector3

T = TypeVar("T")


@dataclass(frozen=True)
class PerStep(Generic[T]):
    """Something about one control step, with the number and the instant of the step."""

    step: int
    stamp_ns: int
    value: T


@dataclass(frozen=True, eq=False)
class PairEstimate:
    """One ordered pair of vehicles as the controller sees it (relform_msgs/PairState)."""

    observer: str
    target: str
    p_B1B2_C1__est: Array
    """[m], shape (3,)."""
    p_B1B2_C1__ref: Array
    """Target of the formation, without its ramp [m], shape (3,)."""
    yaw_I1I2: float
    """[rad], in (-pi, pi]."""
    yaw_variance: float
    """[rad^2]; infinite where the yaw cannot be observed."""
    yaw_held: bool
    """Whether the yaw could not be measured in this step and was propagated with the gyros."""
    yaw_singular: bool = False
    """Whether the standard deviation of the yaw is beyond ``controller.relative_yaw_std_max``."""
    covariance: Array | None = None
    """Of p_B1B2_C1 and yaw_I1I2 [m, rad], shape (4, 4); None: unknown."""


@dataclass(frozen=True, eq=False)
class LeaderEstimate:
    """The leader in the world as the controller sees it."""

    p_NB_N: Array
    """[m], shape (3,)."""
    yaw_NB: float
    """[rad]."""
    covariance: Array | None
    """Of p_NB_N and yaw_NB [m, rad], shape (4, 4); None: unknown."""


@dataclass(frozen=True)
class EstimatorReport:
    """What the estimator did in one control step."""

    mode: EstimatorMode
    reason: str
    """Why the mode is not MEASURED, for people; else empty."""
    nis: float = math.nan
    """Normalised innovation squared of the sightings that arrived in this step; NaN: the estimator has no
    innovations, or nothing was seen."""
    nis_dof: int = 0
    """Degrees of freedom of its chi-square distribution."""
    rejected: tuple[str, ...] = ()
    """The measurements that did not fit and were not used, for people."""
    restarts: int = 0
    """How often the estimator has begun anew in the flight; in the diagnostics, not in FormationState."""


@dataclass(frozen=True, eq=False)
class TeamState:
    """The team as the controller sees it (relform_msgs/FormationState)."""

    phase: str
    """Name of the scenario phase."""
    pairs: tuple[PairEstimate, ...]
    """Every ordered pair, observers and targets in team order."""
    leader_position_error: float
    """Norm of measured minus reference position [m]."""
    leader_yaw_error: float
    """Measured minus reference yaw [rad], in (-pi, pi]."""
    leader: LeaderEstimate | None = None
    """None: recorded by an older version."""
    estimator: EstimatorReport | None = None
    """None: recorded by an older version."""


@dataclass(frozen=True, eq=False)
class TeamReference:
    """What the controller is asked to track at one instant (relform_msgs/FormationReference)."""

    phase: str
    """Name of the scenario phase."""
    p_NB_N: Array
    """Of the leader [m], shape (3,)."""
    v_NB_N: Array
    """Of the leader [m/s], shape (3,)."""
    yaw_NB: float
    """Of the leader, continuous [rad]."""
    formation: Mapping[tuple[str, str], Array]
    """p_B1B2_C1 by (observer, target), without ramp [m], shape (3,) each."""


@dataclass(frozen=True)
class SolverReport:
    """What the solver did in one control step (relform_msgs/SolverStatus); NaN: no SQP step was taken."""

    state: SolverState
    fallback_reason: str
    """Why an SQP step failed, or why the control step started again; empty: neither happened."""
    objective: float
    kkt_first: float
    kkt: float
    sqp_steps: int
    """SQP steps begun, failed ones too: what a replay must impose to end in the same way."""
    qp_iterations: int
    active_bounds: int
    active_constraints: tuple[str, ...]
    """Names of the soft constraints that are active in the plan, such as ``tilt leader``."""
    prepare_time: float
    """Of the preparation that preceded this control step [s]."""
    feedback_time: float
    """From the measurements to the plan, further SQP steps included [s]."""


@dataclass(frozen=True)
class Nearest:
    """Two vehicles, and how far apart they are."""

    vehicles: tuple[str, str]
    """In team order."""
    distance: float
    """[m]"""


@dataclass(frozen=True)
class Alarm:
    """A danger that begins in a control step; the flight goes on."""

    source: str
    """What it is about, such as a vehicle."""
    description: str


@dataclass(frozen=True)
class SeparationReport:
    """How far apart the vehicles are (relform_msgs/Separation)."""

    level: SeparationLevel
    estimated: Nearest
    """The two that are nearest by the estimate of the controller."""
    measured: Nearest | None
    """The two that are nearest by the ranges that vehicles have measured; None: none arrived lately."""
    predicted: Nearest
    """The two that come nearest in the plan."""
    predicted_in: float
    """How far ahead that is [s]."""

    def __str__(self) -> str:
        near = min((self.estimated, *filter(None, [self.measured])), key=lambda nearest: nearest.distance)
        first, second = near.vehicles
        return f"{first} and {second} are {near.distance:.2f} m apart"


@dataclass(frozen=True, eq=False)
class Decision:
    """Everything that one control step decided and saw."""

    step: int
    stamp_ns: int
    commands: Mapping[str, RotorCommand]
    """By vehicle name, in team order."""
    solver: SolverReport
    state: TeamState
    reference: TeamReference
    holds_for: str = ""
    """What the start of the mission still waits for while the team holds its place; empty: it has started."""
    separation: SeparationReport | None = None
    """None: nobody asked for it."""
    breach: str = ""
    """Which vehicles are outside the geofence, or may be, and where; empty: none is."""
    alarms: tuple[Alarm, ...] = ()
    """Those that begin in this step."""


@dataclass(frozen=True, eq=False)
class Standby:
    """A control step without a decision: the vehicles are on the ground, or fly on their own sensors."""

    reason: str
    """What the team waits for, for people."""
    commands: Mapping[str, RotorCommand] = field(default_factory=dict)
    """Requests to the vehicles by name, in team order; empty: none."""


@dataclass(frozen=True)
class TeamStatus:
    """What a team does between the ground and the air (relform_msgs/TeamStatus)."""

    mode: TeamMode
    reason: str
    """Why the mode is what it is, unless somebody asked for it."""
    refused: str
    """Why the newest request was refused; empty: it was not."""
    vehicle_modes: Mapping[str, VehicleMode]
    """By vehicle that was heard, in team order."""


@dataclass(frozen=True)
class StepDecided:
    """A control step was computed."""

    inputs: tuple[tuple[str, int], ...]
    """Topic and stamp [ns] of each message that the step used."""
    sqp_steps: int
    """SQP steps begun, one that failed included."""
    waiting_for: str = ""
    """What was missing for the first commands of the flight; empty: the step has commands."""


@dataclass(frozen=True)
class FormationSet:
    """A formation was accepted and applies from the step of the event on."""

    formation: Mapping[str, Vector3]
    """Position of each follower relative to the leader, in the leader's {mc} [m]."""


@dataclass(frozen=True)
class RequestMade:
    """The team was asked for something, which applies from the step of the event on."""

    request: TeamRequest
    values: tuple[float, ...] = ()
    """GO_TO: x, y, z [m] and yaw [rad] of the leader in the world; a yaw that is NaN stays as it is.
    FOLLOW_TRAJECTORY: rows of the time from then [s], x, y, z and yaw. Else empty."""


@dataclass(frozen=True)
class ParametersSet:
    """Parameters of the source were changed; they apply from the step of the event on."""

    changes: Mapping[str, Value]
    """By dotted key, with the units of the keys."""


@dataclass(frozen=True)
class FaultReported:
    """A vehicle cannot continue."""

    description: str


@dataclass(frozen=True)
class AlarmRaised:
    """The controller has noticed a danger."""

    description: str


@dataclass(frozen=True)
class TakenOver:
    """The controller was started in flight, and takes the team over from the step of the event on."""


EventContent = (
    StepDecided | FormationSet | ParametersSet | FaultReported | RequestMade | AlarmRaised | TakenOver
)


@dataclass(frozen=True)
class Event:
    """Something that a replay must impose beside the sensor data (relform_msgs/FormationEvent)."""

    source: str
    """Vehicle or node that caused the event."""
    content: EventContent
