"""What is known of a flight: the newest that its topics have said, and a bounded log of what happened."""

from collections import deque
from dataclasses import dataclass
from enum import Enum

import numpy as np

from relform_analysis.flight.tracking_errors import yaw_of
from relform_core.arrays import Array
from relform_core.flight_modes import TeamMode
from relform_core.measurements import Odometry
from relform_core.names import EstimatorMode, SolverState
from relform_core.rotation import quaternion_from_yaw
from relform_core.scenario_config import ScenarioConfig
from relform_core.sensors.range_bearing import RangeBearings
from relform_core.telemetry import (
    AlarmRaised,
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
from relform_live.scene.track import Pose, Track, turned

LOG_LINES = 40
ALARMS = frozenset({TeamMode.FAILSAFE, TeamMode.STOPPED})


class Severity(Enum):
    """How much a line of the log matters."""

    NOTE = "note"
    WARNING = "warning"
    ERROR = "error"


@dataclass(frozen=True)
class LogLine:
    """Something that happened."""

    stamp_ns: int
    text: str
    severity: Severity = Severity.NOTE


@dataclass(frozen=True)
class Sighting:
    """Which others a vehicle saw at an instant."""

    stamp_ns: int
    targets: frozenset[str]


class FlightData:
    """Takes in the messages of a flight, each as an object of the core."""

    def __init__(self, config: ScenarioConfig) -> None:
        vehicles = config.team.vehicles
        self.config = config
        self.truths = {vehicle: Track() for vehicle in vehicles}
        """What is simulated."""
        self.estimates = {vehicle: Track() for vehicle in vehicles}
        """What the controller believes, level because it says nothing of roll and pitch."""
        self.leader_reference = Track()
        self.state: PerStep[TeamState] | None = None
        self.reference: PerStep[TeamReference] | None = None
        self.solver: PerStep[SolverReport] | None = None
        self.status: TeamStatus | None = None
        """Only of flights from the ground."""
        self.fallbacks = 0
        """Control steps of this flight in which the solver was seen to fall back."""
        self.sightings: dict[str, Sighting] = {}
        """By observer."""
        self._errors: dict[tuple[str, str], float] = {}
        self._errors_known: tuple[int, int] | None = None
        """Stamps of the reference and of the newest truth of which they are [ns]."""
        self.log: deque[LogLine] = deque(maxlen=LOG_LINES)

    def take_truth(self, vehicle: str, odometry: Odometry) -> None:
        """The true pose of a vehicle."""
        self.truths[vehicle].add(Pose(odometry.stamp_ns, odometry.p_NB_N, odometry.q_NB))

    def take_state(self, state: PerStep[TeamState]) -> None:
        """The team as the controller sees it."""
        before, team = self.state, state.value
        self.state = state
        if before is None or before.value.phase != team.phase:
            self.note(state.stamp_ns, f"phase {team.phase}")
        if team.estimator is not None:
            known = None if before is None else before.value.estimator
            mode = team.estimator.mode
            if mode is EstimatorMode.DEGRADED and (known is None or known.mode is not mode):
                self.note(state.stamp_ns, f"estimator degraded: {team.estimator.reason}", Severity.WARNING)
        if team.leader is None:
            return
        leader, p_leader, yaw = self.config.team.leader, team.leader.p_NB_N, team.leader.yaw_NB
        self.estimates[leader].add(Pose(state.stamp_ns, p_leader, quaternion_from_yaw(yaw)))
        for pair in team.pairs:
            if pair.observer == leader and np.isfinite(pair.p_B1B2_C1__est).all():
                place = p_leader + turned(yaw, pair.p_B1B2_C1__est)
                self.estimates[pair.target].add(
                    Pose(state.stamp_ns, place, quaternion_from_yaw(yaw + pair.yaw_I1I2))
                )

    def take_reference(self, reference: PerStep[TeamReference]) -> None:
        """What the controller is asked to track."""
        self.reference = reference
        team = reference.value
        self.leader_reference.add(Pose(reference.stamp_ns, team.p_NB_N, quaternion_from_yaw(team.yaw_NB)))

    def take_solver(self, report: PerStep[SolverReport]) -> None:
        """What the solver did."""
        before, solver = self.solver, report.value
        if before is not None and report.stamp_ns < before.stamp_ns:
            self.fallbacks = 0
        self.solver = report
        if solver.state is SolverState.FALLBACK:
            self.fallbacks += 1
            if before is None or before.value.state is not solver.state:
                text = f"solver fell back: {solver.fallback_reason}"
                self.note(report.stamp_ns, text, Severity.WARNING)

    def take_status(self, status: PerStep[TeamStatus]) -> None:
        """What the team does between the ground and the air."""
        before, team = self.status, status.value
        self.status = team
        if before is None or before.mode is not team.mode:
            severity = Severity.ERROR if team.mode in ALARMS else Severity.NOTE
            reason = f": {team.reason}" if team.reason else ""
            self.note(status.stamp_ns, f"team {team.mode}{reason}", severity)
        if team.refused and (before is None or before.refused != team.refused):
            self.note(status.stamp_ns, team.refused, Severity.WARNING)

    def take_sightings(self, vehicle: str, bearings: RangeBearings) -> None:
        """Whom a vehicle sees."""
        self.sightings[vehicle] = Sighting(bearings.stamp_ns, frozenset(bearings.by_target))

    def take_event(self, event: PerStep[Event]) -> None:
        """An event of the flight."""
        source = event.value.source
        match event.value.content:
            case FormationSet():
                self.note(event.stamp_ns, "a new formation was set")
            case ParametersSet(changes):
                values = ", ".join(f"{key} = {value}" for key, value in changes.items())
                self.note(event.stamp_ns, f"{source}: {values}")
            case RequestMade(request):
                self.note(event.stamp_ns, f"{request.value.replace('_', ' ')} requested")
            case TakenOver():
                self.note(event.stamp_ns, f"{source} takes the team over", Severity.WARNING)
            case FaultReported(description) | AlarmRaised(description):
                self.note(event.stamp_ns, f"{source}: {description}", Severity.ERROR)

    def clear(self) -> None:
        """Forget everything; another part of the flight follows."""
        for track in (*self.truths.values(), *self.estimates.values(), self.leader_reference):
            track.clear()
        self.state = self.reference = self.solver = self.status = None
        self._errors_known = None
        self.fallbacks = 0
        self.sightings.clear()
        self.log.clear()

    def note(self, stamp_ns: int, text: str, severity: Severity = Severity.NOTE) -> None:
        """Add a line to the log."""
        self.log.append(LogLine(stamp_ns, text, severity))

    @property
    def newest_ns(self) -> int | None:
        """The newest instant for which all true poses are known; None: there is none."""
        tracks = self.truths.values()
        return min(track.newest.stamp_ns for track in tracks) if all(tracks) else None

    def sees(self, observer: str, target: str) -> bool:
        """Whether one vehicle has seen another in the last steps."""
        sighting, newest_ns = self.sightings.get(observer), self.newest_ns
        if sighting is None or newest_ns is None or target not in sighting.targets:
            return False
        return newest_ns - sighting.stamp_ns <= 0.3 * NANOSECONDS_PER_SECOND

    def formation_errors(self) -> dict[tuple[str, str], float]:
        """True error of each ordered pair at the instant of the reference [m]; empty: not known yet."""
        if self.reference is None or (newest_ns := self.newest_ns) is None:
            return {}
        known = (self.reference.stamp_ns, newest_ns)
        if known != self._errors_known:  # several parts of the page ask in each picture
            self._errors_known, self._errors = known, self._formation_errors(self.reference)
        return self._errors

    def _formation_errors(self, reference: PerStep[TeamReference]) -> dict[tuple[str, str], float]:
        at = {vehicle: track.at(reference.stamp_ns) for vehicle, track in self.truths.items()}
        return {
            pair: float(np.linalg.norm(_seen(at[pair[0]], at[pair[1]]) - wanted))
            for pair, wanted in reference.value.formation.items()
        }

    def leader_error(self) -> float | None:
        """True distance of the leader from its reference [m]; None: not known yet."""
        track = self.truths[self.config.team.leader]
        if self.reference is None or not track:
            return None
        return float(np.linalg.norm(track.at(self.reference.stamp_ns).p_NB_N - self.reference.value.p_NB_N))


def _seen(observer: Pose, target: Pose) -> Array:
    """Position of the target in {mc} of the observer [m]."""
    return turned(-float(yaw_of(observer.q_NB)), target.p_NB_N - observer.p_NB_N)
