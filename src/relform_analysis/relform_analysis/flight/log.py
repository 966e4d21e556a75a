"""A flight as arrays: what the vehicles did, what the controller was asked and what it answered.

Shapes: T instants of ground truth, K control steps, n vehicles in team order, leader first. What was not
recorded is NaN.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from relform_core import names
from relform_core.arrays import Array, Integers
from relform_core.errors import BagError
from relform_core.load import LoadedScenario
from relform_core.measurements import Odometry
from relform_core.names import EventKind
from relform_core.telemetry import Decision
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
VEHICLE_TOPICS = (names.GROUND_TRUTH, names.ROTOR_SPEEDS)
"""Topics of each vehicle that a log is made of."""
TEAM_TOPICS = (names.REFERENCE, names.STATE, names.SOLVER, names.EVENTS)
"""Topics of the team that a log is made of."""


@dataclass(frozen=True)
class Fault:
    """Why a flight could not go on."""

    stamp_ns: int
    source: str
    description: str


@dataclass(frozen=True, eq=False)
class FlightLog:
    """A flight, or what there is of it."""

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
    rotor_speeds: Array
    """Commanded, rotors front, left, back, right [rad/s], shape (K, n, 4)."""
    solver: Mapping[str, Array]
    """``status`` (a constant of relform_msgs/SolverStatus) and each of ``SOLVER_FIELDS``, shape (K,)."""
    faults: tuple[Fault, ...]

    @property
    def vehicles(self) -> tuple[str, ...]:
        """Names in team order."""
        return self.scenario.config.team.vehicles

    @property
    def step_ns(self) -> Integers:
        """Instants of the control steps, shape (K,)."""
        return self.tick_ns[self.tick_of_step]


@dataclass(eq=False)
class _Step:
    """One control step while its parts come in."""

    vehicles: int
    phase: str | None = None
    leader_p_NB_N__ref: Any = (np.nan,) * 3
    leader_v_NB_N__ref: Any = (np.nan,) * 3
    leader_yaw__ref: float = np.nan
    solver: dict[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        n = self.vehicles
        self.p_BB_C__ref = np.full((n, n, 3), np.nan)
        self.p_BB_C__est = np.full((n, n, 3), np.nan)
        self.yaw_BB__est = np.full((n, n), np.nan)
        self.yaw_variance = np.full((n, n), np.nan)
        self.rotor_speeds = np.full((n, ROTORS), np.nan)


class FlightLogBuilder:
    """Collects a flight: from messages (``add``), or from the core types of a flight without ROS."""

    def __init__(self, scenario: LoadedScenario) -> None:
        self._scenario = scenario
        vehicles = scenario.config.team.vehicles
        self._index = {name: index for index, name in enumerate(vehicles)}
        self._ground_truth: dict[str, dict[int, Odometry]] = {name: {} for name in vehicles}
        self._steps: dict[int, _Step] = {}
        self._faults: list[Fault] = []

    def add_ground_truth(self, vehicle: str, odometry: Odometry) -> None:
        """Take the true state of a vehicle at one instant."""
        self._ground_truth[vehicle][odometry.stamp_ns] = odometry

    def add_decision(self, decision: Decision) -> None:
        """Take everything about one control step."""
        stamp_ns, reference = decision.stamp_ns, decision.reference
        self._add_reference(stamp_ns, reference.phase, reference.p_NB_N, reference.v_NB_N, reference.yaw_NB)
        for (observer, target), position in reference.formation.items():
            self._step(stamp_ns).p_BB_C__ref[self._index[observer], self._index[target]] = position
        for pair in decision.state.pairs:
            self._add_pair(
                stamp_ns, (pair.observer, pair.target), pair.p_B1B2_C1__est, pair.yaw_I1I2, pair.yaw_variance
            )
        for vehicle, command in decision.commands.items():
            self._step(stamp_ns).rotor_speeds[self._index[vehicle]] = command.speeds
        self._add_solver(stamp_ns, decision.solver.state, decision.solver)

    def add_fault(self, stamp_ns: int, source: str, description: str) -> None:
        """Take the reason why the flight ends."""
        self._faults.append(Fault(stamp_ns, source, description))

    @staticmethod
    def needs(topic: str) -> bool:
        """Whether messages of this topic can be part of a log."""
        return topic in TEAM_TOPICS or topic.rpartition("/")[2] in VEHICLE_TOPICS

    def add(self, topic: str, message: Any) -> None:
        """Take a ROS message of any topic of the flight; what the log does not need is ignored.

        The message is used by its fields only, so it may come from any deserializer.

        Raises:
            BagError: it names a vehicle that is not of the team.
        """
        try:
            self._add(topic, message)
        except KeyError as error:
            raise BagError(f"{topic}: names the vehicle {error}, which is not of the team") from None

    def missing(self) -> str | None:
        """Why the log has no control step, in words; None: it has."""
        for vehicle, states in self._ground_truth.items():
            if not states:
                return f"there is no message on {names.vehicle_topic(vehicle, names.GROUND_TRUTH)}"
        steps = {stamp_ns for stamp_ns, step in self._steps.items() if step.phase is not None}
        if not steps:
            return f"there is no message on {names.REFERENCE}"
        if not steps.intersection(*self._ground_truth.values()):
            return f"{names.REFERENCE} and the ground truth have no instant in common"
        return None

    def build(self) -> FlightLog:
        """The log of what has come in so far; steps that lack the reference or ground truth are left out."""
        ticks = sorted(set.intersection(*map(set, self._ground_truth.values())))
        tick_of = {stamp_ns: tick for tick, stamp_ns in enumerate(ticks)}
        stamps = sorted(s for s, step in self._steps.items() if step.phase is not None and s in tick_of)
        steps = [self._steps[stamp_ns] for stamp_ns in stamps]

        def truth(name: str, size: int) -> Array:
            team = self._ground_truth.values()
            rows = [[getattr(states[stamp_ns], name) for states in team] for stamp_ns in ticks]
            return np.asarray(rows, dtype=np.float64).reshape(len(ticks), len(team), size)

        def logged(name: str, *shape: int) -> Array:
            rows = [getattr(step, name) for step in steps]
            return np.asarray(rows, dtype=np.float64).reshape(len(steps), *shape)

        n = len(self._index)
        return FlightLog(
            scenario=self._scenario,
            tick_ns=np.asarray(ticks, dtype=np.int64),
            p_NB_N=truth("p_NB_N", 3),
            q_NB=truth("q_NB", 4),
            v_NB_B=truth("v_NB_B", 3),
            w_NB_B=truth("w_NB_B", 3),
            tick_of_step=np.asarray([tick_of[stamp_ns] for stamp_ns in stamps], dtype=np.int64),
            phase=tuple(step.phase or "" for step in steps),
            leader_p_NB_N__ref=logged("leader_p_NB_N__ref", 3),
            leader_v_NB_N__ref=logged("leader_v_NB_N__ref", 3),
            leader_yaw__ref=logged("leader_yaw__ref"),
            p_BB_C__ref=logged("p_BB_C__ref", n, n, 3),
            p_BB_C__est=logged("p_BB_C__est", n, n, 3),
            yaw_BB__est=logged("yaw_BB__est", n, n),
            yaw_variance=logged("yaw_variance", n, n),
            rotor_speeds=logged("rotor_speeds", n, ROTORS),
            solver={
                name: np.asarray([step.solver.get(name, np.nan) for step in steps], dtype=np.float64)
                for name in ("status", *SOLVER_FIELDS)
            },
            faults=tuple(self._faults),
        )

    def _add(self, topic: str, message: Any) -> None:
        match topic:
            case names.REFERENCE:
                self._add_reference(
                    _stamp_ns(message),
                    message.phase,
                    _xyz(message.leader_position),
                    _xyz(message.leader_velocity),
                    message.leader_yaw,
                )
                for pair in message.formation:
                    observer, target = self._index[pair.observer_id], self._index[pair.target_id]
                    self._step(_stamp_ns(message)).p_BB_C__ref[observer, target] = _xyz(pair.position)
            case names.STATE:
                for pair in message.pairs:
                    self._add_pair(
                        _stamp_ns(message),
                        (pair.observer_id, pair.target_id),
                        _xyz(pair.position),
                        pair.yaw,
                        pair.yaw_variance,
                    )
            case names.SOLVER:
                self._add_solver(_stamp_ns(message), message.status, message)
            case names.EVENTS if message.kind == EventKind.FAULT:
                self.add_fault(_stamp_ns(message), message.source, message.description)
            case _:
                self._add_of_vehicle(topic, message)

    def _add_of_vehicle(self, topic: str, message: Any) -> None:
        match topic.split("/"):
            case [_, vehicle, names.GROUND_TRUTH] if vehicle in self._index:
                self.add_ground_truth(vehicle, _odometry(message))
            case [_, vehicle, names.ROTOR_SPEEDS] if vehicle in self._index:
                self._step(_stamp_ns(message)).rotor_speeds[self._index[vehicle]] = message.speeds

    def _step(self, stamp_ns: int) -> _Step:
        if (step := self._steps.get(stamp_ns)) is None:
            step = self._steps[stamp_ns] = _Step(len(self._index))
        return step

    def _add_reference(
        self, stamp_ns: int, phase: str, position: Iterable[float], velocity: Iterable[float], yaw: float
    ) -> None:
        step = self._step(stamp_ns)
        step.phase = phase
        step.leader_p_NB_N__ref = position
        step.leader_v_NB_N__ref = velocity
        step.leader_yaw__ref = yaw

    def _add_pair(
        self, stamp_ns: int, pair: tuple[str, str], position: Iterable[float], yaw: float, variance: float
    ) -> None:
        observer, target = pair
        step, index = self._step(stamp_ns), (self._index[observer], self._index[target])
        step.p_BB_C__est[index] = position
        step.yaw_BB__est[index] = yaw
        step.yaw_variance[index] = variance

    def _add_solver(self, stamp_ns: int, status: int, report: Any) -> None:
        numbers = {name: float(getattr(report, name)) for name in SOLVER_FIELDS}
        self._step(stamp_ns).solver = {"status": float(status), **numbers}


def _stamp_ns(message: Any) -> int:
    stamp = message.header.stamp
    return int(stamp.sec) * NANOSECONDS_PER_SECOND + int(stamp.nanosec)


def _xyz(vector: Any) -> tuple[float, float, float]:
    return vector.x, vector.y, vector.z


def _odometry(message: Any) -> Odometry:
    pose, twist = message.pose.pose, message.twist.twist
    q = pose.orientation
    return Odometry(
        stamp_ns=_stamp_ns(message),
        p_NB_N=np.array(_xyz(pose.position)),
        q_NB=np.array([q.x, q.y, q.z, q.w]),
        v_NB_B=np.array(_xyz(twist.linear)),
        w_NB_B=np.array(_xyz(twist.angular)),
        pose_covariance=np.reshape(message.pose.covariance, (6, 6)),
        twist_covariance=np.reshape(message.twist.covariance, (6, 6)),
    )
