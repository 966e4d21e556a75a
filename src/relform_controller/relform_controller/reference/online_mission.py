"""The mission of a team in the air on request: hover, fly the phases, go to a place, follow a trajectory."""

import contextlib
import math
from collections.abc import Mapping

import numpy as np

from relform_controller.ocp.frames import rotations_z
from relform_controller.reference.fence import check_phases, check_place
from relform_controller.reference.form_up import StartPoses
from relform_controller.reference.formation import FormationSchedule
from relform_controller.reference.leader_path import LeaderPath, LeaderState, PhasesPath, Transfer, braking
from relform_controller.reference.mission import MissionReference
from relform_controller.reference.timed_path import DURATION_MAX, TimedPath
from relform_controller.reference.trajectory import LeaderTrajectory
from relform_core.arrays import Array, Integers
from relform_core.blend import Blend
from relform_core.errors import ConfigError
from relform_core.geofence_config import GeofenceConfig
from relform_core.obstacles import clearance
from relform_core.phases_config import PhaseConfig
from relform_core.scenario_config import ScenarioConfig
from relform_core.schema import Vector3
from relform_core.units import NANOSECONDS_PER_SECOND

HOVER, GO_TO, FOLLOW, DESCEND = "(hover)", "(go to)", "(trajectory)", "(descend)"
"""Names in telemetry of what the leader does between the phases of the scenario."""
_CHANGE_SAMPLES_PER_S = 10.0
"""Number of instants at which a change of formation is checked, by time."""
_SAMPLES_PER_S = 20.0
"""Number of points at which the way of the team is checked, by time."""


def phases_trajectory(config: ScenarioConfig) -> LeaderTrajectory:
    """The motions of the phases of a scenario, from its start; that of a long flight takes a second."""
    lead = config.command_lead_ns / NANOSECONDS_PER_SECOND
    n_extra = math.ceil((lead + config.controller.horizon) / config.controller.period - 1e-9)
    return LeaderTrajectory(config, n_extra)


class OnlineMission:
    """The leader flies what it was last asked to, then hovers; the formation is the last one asked for.

    Implements ``Mission``. A request applies from the next control step on, and is checked when it is made.
    While the phases of the scenario are flown, they change the formation as well.

    Args:
        config: the scenario.
        trajectory: its ``phases_trajectory``, if it is there already.
    """

    def __init__(self, config: ScenarioConfig, trajectory: LeaderTrajectory | None = None) -> None:
        self._config = config
        self._limits = config.controller.leader_motion
        self._flies_around_obstacles = config.controller.constraints.keep_out is not None
        self._trajectory = trajectory or phases_trajectory(config)
        only_first = {"phases": config.phases[:1]}  # the others are flown on request
        self._schedule = FormationSchedule(config.model_copy(update=only_first))
        self._path: LeaderPath | None = None
        """None: where the leader is was not said yet."""
        self._path_start_ns = 0
        self._doing = HOVER
        self._phase = -1
        """Index of the phase that is flown; -1: none."""

    @property
    def formation(self) -> Mapping[str, Vector3]:
        """See ``Mission``."""
        return self._schedule.by_follower

    @property
    def is_resting(self) -> bool:
        """Whether the leader has come to rest, in formation, at the next control step."""
        next_ns = self._schedule.next_ns
        return self._left(next_ns) <= 0.0 and self._phase < 0 and not self._schedule.is_changing(next_ns)

    def way_to(self, formation: Mapping[str, Vector3]) -> Blend:
        """See ``Mission``."""
        return self._schedule.way_to(formation)

    def check_formation(self, formation: Mapping[str, Vector3]) -> None:
        """See ``Mission``; no vehicle may get to the ground or into an obstacle on the leader's way."""
        if formation != self.formation:
            self._schedule.check(formation)
            elapsed = self._elapsed(self._schedule.next_ns)
            self._check_way(self._flown, elapsed, *self._until(formation), fence=self._config.geofence)

    def set_formation(self, formation: Mapping[str, Vector3]) -> None:
        """See ``Mission``."""
        self.check_formation(formation)
        self._schedule.request(formation)

    def start(self) -> None:
        """Fly the phases of the scenario, from where the leader is.

        Raises:
            ConfigError: the team would come to the ground, into an obstacle or out of the geofence, or cannot
                change from its present formation to the first one.
        """
        path = PhasesPath(self._config, self._trajectory, self._state())
        check_phases(self._config, path.at, margin=0.0)  # checked with its margin before the flight
        first = self._config.formations[self._config.phases[0].formation]
        if first != self.formation:
            self._schedule.check(first)
        formations = [self._config.formations[phase.formation] for phase in self._config.phases]
        self._check_way(path, 0.0, *formations, fence=None)
        self._begin(path, self._config.phases[0].name)
        self._phase = 0
        self._schedule.request(first)

    def hover(self) -> None:
        """Brake, and stay."""
        path = braking(self._state(), self._schedule.from_next_step_on(), self._config)
        self._begin(path, HOVER)

    def halt(self) -> None:
        """See ``Mission``."""
        self.hover()

    def go_to(self, p_NB_N: Array, yaw_NB: float) -> None:
        """Take the leader to a place, and stay there.

        Args:
            p_NB_N: [m], shape (3,).
            yaw_NB: [rad]; NaN: as it is.
        Raises:
            ConfigError: the place is not finite or too far, or the team would come to the ground, into an
                obstacle or out of the geofence.
        """
        if not np.isfinite(p_NB_N).all() or math.isinf(yaw_NB):
            raise ConfigError(f"go_to needs a finite place (got {p_NB_N.tolist()} m, {yaw_NB:g} rad)")
        state = self._state()
        path = Transfer(state, p_NB_N, state.yaw_NB if math.isnan(yaw_NB) else yaw_NB, self._limits)
        if path.duration > DURATION_MAX:
            raise ConfigError(
                f"go_to would take {path.duration:.0f} s, at most {DURATION_MAX:g} s are allowed: go part of "
                "the way first"
            )
        self._check_way(path, 0.0, fence=self._config.geofence)
        self._begin(path, GO_TO)

    def descend(self, height: float) -> None:
        """Brake, and sink until the lowest vehicle is at a height above the ground [m]; never climb."""
        state = self._state()
        stop = Transfer.to_rest(state, self._limits)
        place = stop.at(np.array([stop.duration])).p_NB_N[0]
        place[2] = min(place[2], height - self._lowest_place())
        self._begin(Transfer(state, place, state.yaw_NB, self._limits), DESCEND)

    def rise(self, height: float) -> None:
        """From rest, climb until the lowest vehicle is at a height above the ground [m]; never sink."""
        state = self._state()
        place = state.p_NB_N.copy()
        place[2] = max(place[2], height - self._lowest_place())
        self._begin(Transfer(state, place, state.yaw_NB, self._limits), HOVER)

    def _lowest_place(self) -> float:
        """Height of the lowest vehicle above the leader, now or after a change of formation; <= 0 [m]."""
        formations = self._schedule.from_next_step_on()
        return min(0.0, *(up for formation in formations for _, _, up in formation.values()))

    def follow_trajectory(self, rows: Array) -> None:
        """Take the leader along a trajectory, and stay at its end.

        Args:
            rows: see ``TimedPath``.
        Raises:
            ConfigError: see ``TimedPath``; or the team would come to the ground, into an obstacle, or out of
                the geofence.
        """
        path = TimedPath(self._state(), rows, self._limits)
        self._check_way(path, 0.0, fence=self._config.geofence)
        self._begin(path, FOLLOW)

    def hold(self, poses: StartPoses) -> None:
        """See ``Mission``; the leader stays where it was at the first call."""
        if self._path is None:
            place = LeaderState.at_rest(poses.p_NB_N, poses.yaw_NB)
            self._path = Transfer(place, place.p_NB_N, place.yaw_NB, self._limits)
        self._schedule.hold(poses)

    def advance(self, stamp_ns: int) -> None:
        """See ``Mission``."""
        if self._phase >= 0:
            self._advance_phase(stamp_ns)
        self._schedule.advance(stamp_ns)

    def reference(self, stamps_ns: Integers) -> MissionReference:
        """See ``Mission``."""
        since = np.maximum((stamps_ns - self._path_start_ns) / NANOSECONDS_PER_SECOND, 0.0)
        return MissionReference(
            phase=self._doing if self._left(int(stamps_ns[0])) > 0.0 or self._phase >= 0 else HOVER,
            leader=self._flown.at(since),
            p_B1B2_C1=self._schedule.reference(stamps_ns),
            p_B1B2_C1__target=self._schedule.target,
        )

    @property
    def _flown(self) -> LeaderPath:
        if self._path is None:
            raise ValueError("the mission was not told where the leader is")
        return self._path

    def _elapsed(self, stamp_ns: int) -> float:
        """Time since the begin of the leader's path [s]."""
        return max(0.0, (stamp_ns - self._path_start_ns) / NANOSECONDS_PER_SECOND)

    def _left(self, stamp_ns: int) -> float:
        return self._flown.duration - self._elapsed(stamp_ns)

    def _state(self) -> LeaderState:
        """The leader's reference at the next control step."""
        found = self._flown.at(np.array([self._elapsed(self._schedule.next_ns)]))
        return LeaderState(found.p_NB_N[0], found.v_NB_N[0], float(found.yaw_NB[0]))

    def _begin(self, path: LeaderPath, doing: str) -> None:
        self._path, self._path_start_ns = path, self._schedule.next_ns
        self._doing, self._phase = doing, -1

    def _advance_phase(self, stamp_ns: int) -> None:
        """Fly the next phase, or brake after the last one, when it is time."""
        step = (stamp_ns - self._path_start_ns) // self._config.period_ns
        if self._left(stamp_ns) <= 0.0:
            self.hover()
            return
        index = self._config.phase_index(max(step, 0))
        if index != self._phase:
            phase = self._config.phases[index]
            if phase.formation != self._config.phases[self._phase].formation:
                self._change_for_phase(phase)
            self._phase, self._doing = index, phase.name

    def _change_for_phase(self, phase: PhaseConfig) -> None:
        """Change to the formation of a phase; the team keeps its own if no way was found from there."""
        formation = self._config.formations[phase.formation]
        with contextlib.suppress(ConfigError):
            self._schedule.check(formation)
            self._schedule.request(formation, phase)

    def _until(self, formation: Mapping[str, Vector3]) -> list[Mapping[str, Vector3]]:
        """Formations on the way to another one, itself included; only itself where nothing is in the way."""
        change = self._schedule.way_to(formation)
        is_free = not self._config.obstacles or self._flies_around_obstacles
        if is_free and self._config.geofence is None:
            return [formation]
        times = np.linspace(0.0, change.duration, 1 + math.ceil(change.duration * _CHANGE_SAMPLES_PER_S))
        on_the_way = np.moveaxis(change.at(times)[1:, :-1], 1, 0).tolist()
        followers = self._config.team.followers
        until = [dict(zip(followers, map(tuple, places), strict=True)) for places in on_the_way]
        return [*until, formation]

    def _check_way(
        self, path: LeaderPath, since: float, *later: Mapping[str, Vector3], fence: GeofenceConfig | None
    ) -> None:
        """Check that no vehicle gets to the ground, into an obstacle or out of the geofence.

        Args:
            path: of the leader.
            since: time of the path from which on it is flown [s].
            later: formations beside those that the team has and was asked for.
            fence: the geofence; None: it is not checked.
        Raises:
            ConfigError: one does.
        """
        n_samples = 2 + math.ceil(max(0.0, path.duration - since) * _SAMPLES_PER_S)
        way = path.at(np.linspace(since, max(since, path.duration), n_samples))
        needed = self._config.vehicle.collision_radius
        lowest = float(way.p_NB_N[:, 2].min())
        places = {(self._config.team.leader, (0.0, 0.0, 0.0))}
        formations = (*self._schedule.from_next_step_on(), *later)
        places |= {each for formation in formations for each in formation.items()}
        for vehicle, place in sorted(places):
            if (height := lowest + place[2]) < needed:
                raise ConfigError(
                    f"'{vehicle}' would come to {height:.2f} m above the ground, at least {needed:g} m are "
                    "needed"
                )
            if fence is not None:
                check_place(fence, vehicle, place, way, fence.margin)
            if self._flies_around_obstacles or not self._config.obstacles:
                continue
            p_NB_N = way.p_NB_N + rotations_z(way.yaw_NB) @ np.array(place)
            if (free := float(clearance(self._config.obstacles, p_NB_N).min())) < needed:
                raise ConfigError(
                    f"'{vehicle}' would come within {free:.2f} m of an obstacle, at least {needed:g} m are "
                    "needed"
                )
