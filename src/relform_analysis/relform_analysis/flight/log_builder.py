"""Collects a flight from core types: those of a flight in one process, or those decoded from messages."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from relform_analysis.flight.log import ROTORS, SOLVER_FIELDS, FlightLog, LogEntry
from relform_core.arrays import Array
from relform_core.load import LoadedScenario
from relform_core.measurements import Odometry, RotorCommand
from relform_core.names import GROUND_TRUTH, REFERENCE, vehicle_topic
from relform_core.schema import Vector3
from relform_core.telemetry import (
    Decision,
    Event,
    FaultReported,
    FormationSet,
    ParametersSet,
    PerStep,
    SolverReport,
    TeamReference,
    TeamState,
)


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
    """Collects the log of one controller's flight; the parts of a control step may come in any order.

    Args:
        scenario: every vehicle that is named must be of its team.
        reference: topic of the controller's reference, for the words of ``missing``.
    """

    def __init__(self, scenario: LoadedScenario, reference: str = REFERENCE) -> None:
        self._scenario = scenario
        self._reference = reference
        vehicles = scenario.config.team.vehicles
        self._index = {name: index for index, name in enumerate(vehicles)}
        self._ground_truth: dict[str, dict[int, Odometry]] = {name: {} for name in vehicles}
        self._steps: dict[int, _Step] = {}
        self._faults: list[LogEntry] = []
        self._changes: list[LogEntry] = []

    def add_ground_truth(self, vehicle: str, odometry: Odometry) -> None:
        """Take the true state of a vehicle at one instant."""
        self._ground_truth[vehicle][odometry.stamp_ns] = odometry

    def add_command(self, vehicle: str, command: RotorCommand) -> None:
        """Take what a vehicle was commanded in one control step."""
        self._step(command.stamp_ns).rotor_speeds[self._index[vehicle]] = command.speeds

    def add_reference(self, reference: PerStep[TeamReference]) -> None:
        """Take what the controller was asked to track."""
        step, asked = self._step(reference.stamp_ns), reference.value
        step.phase = asked.phase
        step.leader_p_NB_N__ref = asked.p_NB_N
        step.leader_v_NB_N__ref = asked.v_NB_N
        step.leader_yaw__ref = asked.yaw_NB
        for (observer, target), position in asked.formation.items():
            step.p_BB_C__ref[self._index[observer], self._index[target]] = position

    def add_state(self, state: PerStep[TeamState]) -> None:
        """Take the team as the controller sees it."""
        step = self._step(state.stamp_ns)
        for pair in state.value.pairs:
            index = self._index[pair.observer], self._index[pair.target]
            step.p_BB_C__est[index] = pair.p_B1B2_C1__est
            step.yaw_BB__est[index] = pair.yaw_I1I2
            step.yaw_variance[index] = pair.yaw_variance

    def add_solver(self, report: PerStep[SolverReport]) -> None:
        """Take what the solver did."""
        numbers = {name: float(getattr(report.value, name)) for name in SOLVER_FIELDS}
        self._step(report.stamp_ns).solver = {"status": float(report.value.state), **numbers}

    def add_event(self, event: PerStep[Event]) -> None:
        """Take an event: a fault, or a change of parameters or formation."""
        source = event.value.source
        match event.value.content:
            case FaultReported(description):
                self.add_fault(event.stamp_ns, source, description)
            case ParametersSet(changes):
                words = ", ".join(f"{key} = {value:g}" for key, value in changes.items())
                self._changes.append(LogEntry(event.stamp_ns, source, words))
            case FormationSet(formation):
                self._changes.append(LogEntry(event.stamp_ns, source, _formation_in_words(formation)))

    def add_decision(self, decision: Decision) -> None:
        """Take everything about one control step."""
        step, stamp_ns = decision.step, decision.stamp_ns
        self.add_reference(PerStep(step, stamp_ns, decision.reference))
        self.add_state(PerStep(step, stamp_ns, decision.state))
        self.add_solver(PerStep(step, stamp_ns, decision.solver))
        for vehicle, command in decision.commands.items():
            self.add_command(vehicle, command)

    def add_fault(self, stamp_ns: int, source: str, description: str) -> None:
        """Take the reason why the flight ends."""
        self._faults.append(LogEntry(stamp_ns, source, description))

    def missing(self) -> str | None:
        """Why the log has no control step, in words; None: it has."""
        for vehicle, states in self._ground_truth.items():
            if not states:
                return f"there is no message on {vehicle_topic(vehicle, GROUND_TRUTH)}"
        steps = {stamp_ns for stamp_ns, step in self._steps.items() if step.phase is not None}
        if not steps:
            return f"there is no message on {self._reference}"
        if not steps.intersection(*self._ground_truth.values()):
            return f"{self._reference} and the ground truth have no instant in common"
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
            changes=tuple(self._changes),
        )

    def _step(self, stamp_ns: int) -> _Step:
        if (step := self._steps.get(stamp_ns)) is None:
            step = self._steps[stamp_ns] = _Step(len(self._index))
        return step


def _formation_in_words(formation: Mapping[str, Vector3]) -> str:
    places = (
        f"{follower} at [{', '.join(f'{x:g}' for x in place)}] m" for follower, place in formation.items()
    )
    return f"formation: {', '.join(places)}"
