"""The mission of a flight: it gives the reference at any time and takes requests."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from relform_controller.reference.fence import check_phases, check_place
from relform_controller.reference.form_up import StartPoses
from relform_controller.reference.formation import FormationSchedule
from relform_controller.reference.leader_path import LeaderState, Transfer, braking
from relform_controller.reference.trajectory import LeaderReference, LeaderTrajectory, SampledReference
from relform_core.arrays import Array, Integers
from relform_core.blend import Blend
from relform_core.errors import ConfigError
from relform_core.scenario_config import ScenarioConfig
from relform_core.schema import Vector3
from relform_core.units import NANOSECONDS_PER_SECOND


@dataclass(frozen=True, eq=False)
class MissionReference:
    """What to track at consecutive instants."""

    phase: str
    """Name of the phase at the first instant."""
    leader: LeaderReference
    p_B1B2_C1: Array
    """Formation, a new one blended in: position of the target in {mc} of the observer [m], shape
    (pair, instant, 3)."""
    p_B1B2_C1__target: Array
    """Formation at the first instant, without its ramp [m], shape (pair, 3)."""


class Mission(Protocol):
    """The task of one flight. Instants count from its start [ns], which the controller decides."""

    @property
    def formation(self) -> Mapping[str, Vector3]:
        """The present formation without its ramp: each follower relative to the leader [m]."""

    def way_to(self, formation: Mapping[str, Vector3]) -> Blend:
        """The way of all vehicles to a formation from the next control step on.

        Args:
            formation: position of each follower relative to the leader [m].
        Returns:
            Places in {mc} of the leader, in team order.
        """

    def check_formation(self, formation: Mapping[str, Vector3]) -> None:
        """Check a request without making it; arguments and errors are those of ``set_formation``."""

    def set_formation(self, formation: Mapping[str, Vector3]) -> None:
        """Fly another formation from the next control step on.

        Args:
            formation: position of each follower relative to the leader [m].
        Raises:
            ConfigError: the team cannot fly it; the message gives the reason.
        """

    def halt(self) -> None:
        """From the next control step on brake, and stay inside the geofence; the formation stays as it is."""

    def hold(self, poses: StartPoses) -> None:
        """Until the mission starts, the team should stay at these poses; it forms up from the last ones."""

    def advance(self, stamp_ns: int) -> None:
        """Start the control step at this instant: apply what the mission or a request changes there.

        Raises:
            FlightError: the team cannot form up from the poses that it held.
        """

    def reference(self, stamps_ns: Integers) -> MissionReference:
        """What to track at instants from the present control step on, shape (instant,).

        Raises:
            ValueError: the mission has no reference at one of these instants.
        """


class ScenarioMission:
    """The phases of a scenario, one after the other; a request holds until a phase changes the formation.

    Args:
        config: the scenario.
        leader: what the leader flies in place of the motions of the phases: its reference at times since
            the start of the mission [s], shape (instant,). It is asked one horizon beyond the end.
    """

    def __init__(
        self, config: ScenarioConfig, leader: Callable[[Array], LeaderReference] | None = None
    ) -> None:
        self._config = config
        horizon_steps = math.ceil(config.controller.horizon / config.controller.period - 1e-9)
        n_extra = config.command_lead_steps + horizon_steps
        self._trajectory = (
            LeaderTrajectory(config, n_extra)
            if leader is None
            else SampledReference(leader, config.period_ns)
        )
        self._schedule = FormationSchedule(config)
        self._halt: tuple[int, Transfer] | None = None
        """When the leader began to brake [ns], and how; None: it flies on."""
        if config.geofence is not None:
            check_phases(config, self._leader_at, config.geofence.margin)

    @property
    def formation(self) -> Mapping[str, Vector3]:
        """See ``Mission``."""
        return self._schedule.by_follower

    def way_to(self, formation: Mapping[str, Vector3]) -> Blend:
        """See ``Mission``."""
        return self._schedule.way_to(formation)

    def check_formation(self, formation: Mapping[str, Vector3]) -> None:
        """See ``Mission``; no follower may get to the ground below the path of the leader."""
        if formation != self.formation:
            self._schedule.check(formation)
            self._check_heights(formation)
            self._check_geofence(formation)

    def set_formation(self, formation: Mapping[str, Vector3]) -> None:
        """See ``Mission``."""
        self.check_formation(formation)
        self._schedule.request(formation)

    def _check_heights(self, formation: Mapping[str, Vector3]) -> None:
        if self._config.controller.formation_change is None:  # a recording of an older version
            return
        lowest = self._trajectory.lowest(self._schedule.next_ns, self._schedule.kept_until_ns)
        for follower, (_, _, up) in formation.items():
            if lowest + up <= 0.0:
                raise ConfigError(
                    f"formation puts '{follower}' at {lowest + up:.3f} m above ground, more than 0 m are "
                    f"needed: the leader flies as low as {lowest:.3f} m"
                )

    def _check_geofence(self, formation: Mapping[str, Vector3]) -> None:
        if (fence := self._config.geofence) is None:
            return
        first_ns, last_ns = self._schedule.next_ns, self._schedule.kept_until_ns
        stamps_ns = np.arange(first_ns, max(last_ns, first_ns + 1), self._config.period_ns)
        way = self._leader_at(stamps_ns / NANOSECONDS_PER_SECOND)
        for follower, place in formation.items():
            check_place(fence, follower, place, way, fence.margin)

    def halt(self) -> None:
        """See ``Mission``."""
        next_ns = self._schedule.next_ns
        found = self._leader_at(np.array([next_ns / NANOSECONDS_PER_SECOND]))
        state = LeaderState(found.p_NB_N[0], found.v_NB_N[0], float(found.yaw_NB[0]))
        formations = self._schedule.from_next_step_on()
        self._halt = next_ns, braking(state, formations, self._config)
        self._schedule.ignore_phases()

    def _leader_at(self, times: Array) -> LeaderReference:
        """The leader's reference at times since the start of the mission [s], shape (instant,)."""
        stamps_ns = np.rint(times * NANOSECONDS_PER_SECOND).astype(np.int64)
        if self._halt is None:
            return self._trajectory.at(stamps_ns)
        begin_ns, path = self._halt
        return path.at(np.maximum(stamps_ns - begin_ns, 0) / NANOSECONDS_PER_SECOND)

    def hold(self, poses: StartPoses) -> None:
        """See ``Mission``."""
        self._schedule.hold(poses)

    def advance(self, stamp_ns: int) -> None:
        """See ``Mission``."""
        self._schedule.advance(stamp_ns)

    def reference(self, stamps_ns: Integers) -> MissionReference:
        """See ``Mission``; the scenario's last motion continues for one horizon after the end."""
        return MissionReference(
            phase=self._config.phase_at(int(stamps_ns[0]) // self._config.period_ns).name,
            leader=self._trajectory.at(stamps_ns)
            if self._halt is None
            else self._leader_at(stamps_ns / NANOSECONDS_PER_SECOND),
            p_B1B2_C1=self._schedule.reference(stamps_ns),
            p_B1B2_C1__target=self._schedule.target,
        )
