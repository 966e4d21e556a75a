"""The phases of a scenario, taken up in flight by a controller that does not know what was flown before."""

import dataclasses

import numpy as np

from relform_controller.ocp.frames import wrap_angle
from relform_controller.reference.form_up import StartPoses
from relform_controller.reference.mission import MissionReference, ScenarioMission
from relform_controller.reference.trajectory import LeaderReference
from relform_core.arrays import Array, Integers
from relform_core.blend import Blend
from relform_core.scenario_config import ScenarioConfig
from relform_core.units import NANOSECONDS_PER_SECOND


class ResumedMission(ScenarioMission):
    """The team forms up from where it is, while its leader moves to where the phases want it by now.

    Implements ``Mission``; its instants are those of the flight, in which the phases began at 0. A formation
    that was requested before is not known any more: the one of the present phase is flown.
    """

    def __init__(self, config: ScenarioConfig) -> None:
        # The vehicles may be far from their places, so the formation never changes in one step.
        phases = tuple(phase.model_copy(update={"formation_step": False}) for phase in config.phases)
        super().__init__(config.model_copy(update={"phases": phases}))
        self._held: StartPoses | None = None
        """Where the team was last told to stay."""
        self._leader_offset: tuple[int, Blend, Blend] | None = None
        """Instant at which the mission started [ns], and how far the reference is from the path since then:
        its position [m], and its yaw as the first coordinate [rad]; None: it has not started."""

    def hold(self, poses: StartPoses) -> None:
        """See ``Mission``; the leader stays where it was at the first call."""
        if self._held is None:
            self._held = poses
        self._schedule.hold(dataclasses.replace(poses, p_NB_N=self._held.p_NB_N, yaw_NB=self._held.yaw_NB))

    def advance(self, stamp_ns: int) -> None:
        """See ``Mission``."""
        if self._leader_offset is None and self._held is not None:
            phase = self._config.phase_at(stamp_ns // self._config.period_ns)
            self._schedule.by_follower = self._config.formations[phase.formation]
            self._leader_offset = (stamp_ns, *self._offsets(stamp_ns, self._held))
        super().advance(stamp_ns)

    def reference(self, stamps_ns: Integers) -> MissionReference:
        """See ``Mission``; before the first ``advance`` the team stays where it was."""
        asked = super().reference(stamps_ns)
        if self._leader_offset is not None:
            begin_ns, place, turn = self._leader_offset
            since = np.maximum((stamps_ns - begin_ns) / NANOSECONDS_PER_SECOND, 0.0)
            leader = LeaderReference(
                asked.leader.p_NB_N + place.at(since)[0],
                asked.leader.v_NB_N + place.velocity_at(since)[0],
                asked.leader.yaw_NB + turn.at(since)[0, :, 0],
            )
        elif self._held is not None:
            n = len(stamps_ns)
            leader = LeaderReference(
                np.tile(self._held.p_NB_N, (n, 1)), np.zeros((n, 3)), np.full(n, self._held.yaw_NB)
            )
        else:
            return asked
        return dataclasses.replace(asked, leader=leader)

    def _offsets(self, stamp_ns: int, held: StartPoses) -> tuple[Blend, Blend]:
        """From where the leader is, at rest, to its path, within the limits of its motion."""
        limits = self._config.controller.leader_motion
        path = self._trajectory.at(np.array([stamp_ns]))
        place = Blend.within(
            held.p_NB_N[None] - path.p_NB_N,
            -path.v_NB_N,
            np.zeros((1, 3)),
            limits.speed_max,
            limits.acceleration_max,
        )
        turned: Array = np.array([[wrap_angle(held.yaw_NB - float(path.yaw_NB[0])), 0.0, 0.0]])
        rate = limits.turn_rate_max  # reached within one second
        return place, Blend.within(turned, np.zeros((1, 3)), np.zeros((1, 3)), rate, rate)
