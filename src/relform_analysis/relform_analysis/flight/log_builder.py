"""Collects a flight from core types: those of a flight in one process, or those decoded from messages."""

import sys
from collections.abc import Iterator, Mapping, Sequence
from itertools import chain, groupby

import numpy as np

from relform_analysis.flight.log import (
    ESTIMATOR_FIELDS,
    ROTORS,
    SOLVER_FIELDS,
    FlightLog,
    LogEntry,
)
from relform_analysis.flight.stamped_rows import StampedRows
from relform_analysis.flight.tracking_errors import scored_pairs
from relform_core.arrays import Array
from relform_core.flight_modes import TeamMode
from relform_core.load import LoadedScenario
from relform_core.measurements import Odometry, RotorCommand
from relform_core.names import GROUND_TRUTH, REFERENCE, EstimatorMode, vehicle_topic
from relform_core.schema import Vector3
from relform_core.telemetry import (
    AlarmRaised,
    Decision,
    Event,
    FaultReported,
    FormationSet,
    ParametersSet,
    PerStep,
    RequestMade,
    SolverReport,
    TakenOver,
    TeamReference,
    TeamState,
    TeamStatus,
)
from relform_core.units import NANOSECONDS_PER_SECOND

GROUND_TRUTH_COLUMNS = (("p_NB_N", (3,)), ("q_NB", (4,)), ("v_NB_B", (3,)), ("w_NB_B", (3,)))
SOLVER_COLUMNS = ("status", *SOLVER_FIELDS)
LEADER_COLUMNS = (("leader_p_NB_N__est", (3,)), ("leader_yaw__est", ()), ("leader_covariance", (4, 4)))


def _step_columns(n: int, n_pairs: int) -> list[tuple[str, tuple[int, ...]]]:
    """What is logged of a control step with n vehicles and so many scored pairs."""
    return [
        ("leader_p_NB_N__ref", (3,)),
        ("leader_v_NB_N__ref", (3,)),
        ("leader_yaw__ref", ()),
        ("p_BB_C__ref", (n, n, 3)),
        ("p_BB_C__est", (n, n, 3)),
        ("yaw_BB__est", (n, n)),
        ("yaw_variance", (n, n)),
        ("pair_covariance", (n_pairs, 4, 4)),
        *LEADER_COLUMNS,
        ("rotor_speeds", (n, ROTORS)),
        *((name, ()) for name in (*SOLVER_COLUMNS, *ESTIMATOR_FIELDS)),
    ]


class FlightLogBuilder:
    """Collects the log of one controller's flight; the parts of a control step may come in any order.

    Args:
        scenario: every vehicle that is named must be of its team.
    """

    def __init__(self, scenario: LoadedScenario) -> None:
        self._scenario = scenario
        vehicles = scenario.config.team.vehicles
        self._index = {name: index for index, name in enumerate(vehicles)}
        self._scored = {pair: index for index, pair in enumerate(scored_pairs(scenario.config.team))}
        self._ground_truth = {name: StampedRows(GROUND_TRUTH_COLUMNS) for name in vehicles}
        self._steps = StampedRows(_step_columns(len(vehicles), len(self._scored)))
        self._phases: dict[int, str] = {}
        """Name of the phase by the instant of the control step."""
        self._degraded: dict[int, str] = {}
        """Why the estimator is degraded, by the instant of the control step."""
        self._active: dict[int, tuple[str, ...]] = {}
        """Soft constraints that are active, by the instant of the control step."""
        self._mode: TeamMode | None = None
        """Of the newest status; statuses come in order."""
        self._faults: list[LogEntry] = []
        self._changes: list[LogEntry] = []
        self._alarms: list[LogEntry] = []
        self._real_time: dict[str, Mapping[str, float]] = {}

    def add_ground_truth(self, vehicle: str, odometry: Odometry) -> None:
        """Take the true state of a vehicle at one instant."""
        row = self._ground_truth[vehicle].at(odometry.stamp_ns)
        for name, _ in GROUND_TRUTH_COLUMNS:
            row[name] = getattr(odometry, name)

    def add_command(self, vehicle: str, command: RotorCommand) -> None:
        """Take what a vehicle was commanded in one control step, for an interval that may begin later."""
        sent_ns = command.stamp_ns - self._scenario.config.command_lead_ns
        self._steps.at(sent_ns)["rotor_speeds"][self._index[vehicle]] = command.speeds

    def add_reference(self, reference: PerStep[TeamReference]) -> None:
        """Take what the controller was asked to track."""
        row, asked = self._steps.at(reference.stamp_ns), reference.value
        self._phases[reference.stamp_ns] = sys.intern(asked.phase)
        row["leader_p_NB_N__ref"] = asked.p_NB_N
        row["leader_v_NB_N__ref"] = asked.v_NB_N
        row["leader_yaw__ref"] = asked.yaw_NB
        formation = row["p_BB_C__ref"]
        for (observer, target), position in asked.formation.items():
            formation[self._index[observer], self._index[target]] = position

    def add_state(self, state: PerStep[TeamState]) -> None:
        """Take the team as the controller sees it."""
        row = self._steps.at(state.stamp_ns)
        places, yaws, yaw_variances = row["p_BB_C__est"], row["yaw_BB__est"], row["yaw_variance"]
        for pair in state.value.pairs:
            index = self._index[pair.observer], self._index[pair.target]
            places[index] = pair.p_B1B2_C1__est
            yaws[index] = pair.yaw_I1I2
            yaw_variances[index] = pair.yaw_variance
            scored = self._scored.get((pair.observer, pair.target))
            if scored is not None and pair.covariance is not None:
                row["pair_covariance"][scored] = pair.covariance
        if (leader := state.value.leader) is not None:
            row["leader_p_NB_N__est"] = leader.p_NB_N
            row["leader_yaw__est"] = leader.yaw_NB
            if leader.covariance is not None:
                row["leader_covariance"] = leader.covariance
        if (estimator := state.value.estimator) is not None:
            row["mode"], row["rejected"] = estimator.mode, len(estimator.rejected)
            row["nis"], row["nis_dof"] = estimator.nis, estimator.nis_dof
            if estimator.mode is EstimatorMode.DEGRADED:
                self._degraded[state.stamp_ns] = estimator.reason

    def add_status(self, status: PerStep[TeamStatus]) -> None:
        """Take what the team does between the ground and the air."""
        mode, reason = status.value.mode, status.value.reason
        if mode is not self._mode:
            self._mode = mode
            words = f"{mode}: {reason}" if reason else str(mode)
            self._changes.append(LogEntry(status.stamp_ns, "team", words))

    def add_solver(self, report: PerStep[SolverReport]) -> None:
        """Take what the solver did."""
        row = self._steps.at(report.stamp_ns)
        row["status"] = report.value.state
        for name in SOLVER_FIELDS:
            row[name] = getattr(report.value, name)
        if report.value.active_constraints:
            self._active[report.stamp_ns] = report.value.active_constraints

    def add_event(self, event: PerStep[Event]) -> None:
        """Take an event: a fault, or a change of parameters or formation."""
        source = event.value.source
        match event.value.content:
            case FaultReported(description):
                self.add_fault(event.stamp_ns, source, description)
            case AlarmRaised(description):
                self._alarms.append(LogEntry(event.stamp_ns, source, description))
            case ParametersSet(changes):
                words = ", ".join(f"{key} = {value:g}" for key, value in changes.items())
                self._changes.append(LogEntry(event.stamp_ns, source, f"set {words}"))
            case RequestMade(request, _):
                self._changes.append(LogEntry(event.stamp_ns, source, f"request: {request.value}"))
            case TakenOver():
                self._changes.append(LogEntry(event.stamp_ns, source, "takes the team over"))
            case FormationSet(formation):
                self._changes.append(LogEntry(event.stamp_ns, source, _formation_in_words(formation)))

    def add_report(self, node: str, values: Mapping[str, str]) -> None:
        """Take what a node reports about itself; later reports replace earlier ones."""
        numbers = {key: float(value) for key, value in values.items() if key.startswith("real_time.")}
        if numbers:
            self._real_time[node] = numbers

    def add_decision(self, decision: Decision) -> None:
        """Take everything about one control step."""
        step, stamp_ns = decision.step, decision.stamp_ns
        self.add_reference(PerStep(step, stamp_ns, decision.reference))
        self.add_state(PerStep(step, stamp_ns, decision.state))
        self.add_solver(PerStep(step, stamp_ns, decision.solver))
        self._alarms += [LogEntry(stamp_ns, alarm.source, alarm.description) for alarm in decision.alarms]
        for vehicle, command in decision.commands.items():
            self.add_command(vehicle, command)

    def add_fault(self, stamp_ns: int, source: str, description: str) -> None:
        """Take the reason why the flight ends."""
        self._faults.append(LogEntry(stamp_ns, source, description))

    def missing(self) -> str | None:
        """Why the log has no control step, in words; None if it has one."""
        for vehicle, states in self._ground_truth.items():
            if not states.stamps:
                return f"there is no message on {vehicle_topic(vehicle, GROUND_TRUTH)}"
        if not self._phases:
            return f"there is no message on {REFERENCE}"
        if not self._ticks() & self._phases.keys():
            return f"{REFERENCE} and the ground truth have no instant in common"
        return None

    def build(self) -> FlightLog:
        """The log so far; steps without reference or ground truth are left out."""
        ticks = sorted(self._ticks())
        tick_of = {stamp_ns: tick for tick, stamp_ns in enumerate(ticks)}
        stamps = sorted(stamp_ns for stamp_ns in self._phases if stamp_ns in tick_of)

        def truth(name: str) -> Array:
            return np.stack([states.column(name, ticks) for states in self._ground_truth.values()], axis=1)

        def logged(name: str) -> Array:
            return self._steps.column(name, stamps)

        return FlightLog(
            scenario=self._scenario,
            tick_ns=np.asarray(ticks, dtype=np.int64),
            p_NB_N=truth("p_NB_N"),
            q_NB=truth("q_NB"),
            v_NB_B=truth("v_NB_B"),
            w_NB_B=truth("w_NB_B"),
            tick_of_step=np.asarray([tick_of[stamp_ns] for stamp_ns in stamps], dtype=np.int64),
            phase=tuple(self._phases[stamp_ns] for stamp_ns in stamps),
            leader_p_NB_N__ref=logged("leader_p_NB_N__ref"),
            leader_v_NB_N__ref=logged("leader_v_NB_N__ref"),
            leader_yaw__ref=logged("leader_yaw__ref"),
            p_BB_C__ref=logged("p_BB_C__ref"),
            p_BB_C__est=logged("p_BB_C__est"),
            yaw_BB__est=logged("yaw_BB__est"),
            yaw_variance=logged("yaw_variance"),
            pair_covariance=logged("pair_covariance"),
            **{name: logged(name) for name, _ in LEADER_COLUMNS},
            rotor_speeds=logged("rotor_speeds"),
            solver={name: logged(name) for name in SOLVER_COLUMNS},
            estimator={name: logged(name) for name in ESTIMATOR_FIELDS},
            active_constraints={
                name: np.array([name in self._active.get(stamp_ns, ()) for stamp_ns in stamps], dtype=bool)
                for name in sorted(set(chain.from_iterable(self._active.values())))
            },
            faults=tuple(self._faults),
            changes=tuple(self._changes),
            alarms=tuple(self._alarms),
            degraded=tuple(self._spans_degraded(stamps)),
            real_time=self._real_time,
        )

    def _spans_degraded(self, stamps: Sequence[int]) -> Iterator[LogEntry]:
        """A span of consecutive degraded steps has the reason of its last one, which says for how long."""
        for is_degraded, steps in groupby(stamps, key=lambda stamp_ns: stamp_ns in self._degraded):
            if is_degraded:
                first_ns, *others = steps
                last_ns = others[-1] if others else first_ns
                end = (last_ns + self._scenario.config.period_ns) / NANOSECONDS_PER_SECOND
                reason = self._degraded[last_ns]
                yield LogEntry(first_ns, "estimator", f"degraded until {end:.2f} s: {reason}")

    def _ticks(self) -> set[int]:
        """The instants at which the ground truth of every vehicle is known."""
        return set.intersection(*(set(states.stamps) for states in self._ground_truth.values()))


def _formation_in_words(formation: Mapping[str, Vector3]) -> str:
    places = (
        f"{follower} at [{', '.join(f'{x:g}' for x in place)}] m" for follower, place in formation.items()
    )
    return f"formation: {', '.join(places)}"
