"""A flight as arrays: motion of the vehicles, references, estimates and commands of the controller.

Shapes: T instants of ground truth, K control steps, n vehicles in team order, leader first. What was not
recorded is NaN.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from relform_core.arrays import Array, Integers, Mask
from relform_core.load import LoadedScenario
from relform_core.units import NANOSECONDS_PER_SECOND

ROTORS = 4
SOLVER_FIELDS = (
    "objective",
    "kkt_first",
    "kkt",
    "sqp_steps",
    "qp_iterations",
    "active_bounds",
    "prepare_time",
    "feedback_time",
)
"""Numbers of relform_msgs/SolverStatus that are logged beside its status; times in seconds."""

ESTIMATOR_FIELDS = ("mode", "nis", "nis_dof", "rejected")
"""What is logged of the estimator in relform_msgs/FormationState; of ``rejected`` the number."""


@dataclass(frozen=True)
class LogEntry:
    """Something that happened at one instant, in words."""

    stamp_ns: int
    source: str
    """The vehicle or node that caused it."""
    description: str


@dataclass(frozen=True, eq=False)
class FlightLog:
    """A flight, or as much of it as was recorded."""

    scenario: LoadedScenario
    tick_ns: Integers
    """Instants of ground truth, increasing, shape (T,)."""
    p_NB_N: Array
    """Ground truth: position [m], shape (T, n, 3)."""
    q_NB: Array
    """Ground truth: attitude (x, y, z, w), shape (T, n, 4)."""
    v_NB_B: Array
    """Ground truth: velocity in the body frame [m/s], shape (T, n, 3)."""
    w_NB_B: Array
    """Ground truth: angular velocity [rad/s], shape (T, n, 3)."""
    tick_of_step: Integers
    """Which tick a control step was computed at, shape (K,)."""
    phase: tuple[str, ...]
    """Name of the phase in each control step, length K."""
    leader_p_NB_N__ref: Array
    """In {n} [m], shape (K, 3)."""
    leader_v_NB_N__ref: Array
    """In {n} [m/s], shape (K, 3)."""
    leader_yaw__ref: Array
    """[rad], shape (K,)."""
    p_BB_C__ref: Array
    """x^{mc_i}_{mb_j/mb_i} that the formation asks for, not ramped [m], shape (K, n, n, 3): i observes j."""
    p_BB_C__est: Array
    """The controller's estimate of the same [m], shape (K, n, n, 3)."""
    yaw_BB__est: Array
    """Its estimate of the yaw of j relative to i [rad], shape (K, n, n)."""
    yaw_variance: Array
    """Of that estimate [rad^2], shape (K, n, n)."""
    pair_covariance: Array
    """Of ``p_BB_C__est`` and ``yaw_BB__est`` [m, rad] of the ``scored_pairs``, shape (K, pairs, 4, 4)."""
    leader_p_NB_N__est: Array
    """The controller's estimate in {n} [m], shape (K, 3)."""
    leader_yaw__est: Array
    """Its estimate [rad], shape (K,)."""
    leader_covariance: Array
    """Of these two [m, rad], shape (K, 4, 4)."""
    rotor_speeds: Array
    """Commanded in this step, rotors front, left, back, right [rad/s], shape (K, n, 4)."""
    solver: Mapping[str, Array]
    """``status`` (a constant of relform_msgs/SolverStatus) and each of ``SOLVER_FIELDS``, shape (K,)."""
    estimator: Mapping[str, Array]
    """Each of ``ESTIMATOR_FIELDS``, shape (K,)."""
    faults: tuple[LogEntry, ...]
    """Why the flight could not continue."""
    changes: tuple[LogEntry, ...] = ()
    """What was changed in flight: parameters and formation."""
    active_constraints: Mapping[str, Mask] = field(default_factory=dict)
    """Whether a soft constraint was active in the plan, by name, of those that ever were; shape (K,)."""
    degraded: tuple[LogEntry, ...] = ()
    """When the estimator was degraded, until when, and why."""
    real_time: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    """What each node last reported about the wall clock, by key of /diagnostics; empty: lock-step."""
    alarms: tuple[LogEntry, ...] = ()
    """Dangers that the controller has noticed."""

    @property
    def vehicles(self) -> tuple[str, ...]:
        """Names in team order."""
        return self.scenario.config.team.vehicles

    @property
    def leader(self) -> int:
        """Index of the leader among the vehicles."""
        return self.vehicles.index(self.scenario.config.team.leader)

    @property
    def followers(self) -> tuple[int, ...]:
        """Indices of the followers among the vehicles, in team order."""
        return tuple(self.vehicles.index(name) for name in self.scenario.config.team.followers)

    @property
    def flown(self) -> float:
        """Simulation time of the newest ground truth [s]."""
        return float(self.tick_ns[-1]) / NANOSECONDS_PER_SECOND

    @property
    def step_ns(self) -> Integers:
        """Instants of the control steps, shape (K,)."""
        return self.tick_ns[self.tick_of_step]
