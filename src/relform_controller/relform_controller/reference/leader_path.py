"""Paths of the leader that begin in flight: from any reference to a place, to rest, or along given points."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Protocol, Self

import numpy as np

from relform_controller.ocp.frames import rotation_z, wrap_angle
from relform_controller.reference.trajectory import LeaderReference, LeaderTrajectory
from relform_core.arrays import Array
from relform_core.blend import Blend
from relform_core.controller_config import LeaderMotionConfig
from relform_core.scenario_config import ScenarioConfig
from relform_core.schema import Vector3
from relform_core.units import NANOSECONDS_PER_SECOND


@dataclass(frozen=True, eq=False)
class LeaderState:
    """The leader's reference at one instant."""

    p_NB_N: Array
    """[m], shape (3,)."""
    v_NB_N: Array
    """[m/s], shape (3,)."""
    yaw_NB: float
    """[rad]."""

    @classmethod
    def at_rest(cls, p_NB_N: Array, yaw_NB: float) -> Self:
        """A leader that stays where it is."""
        return cls(p_NB_N, np.zeros(3), yaw_NB)


class LeaderPath(Protocol):
    """The leader's reference over time; it ends at rest, and stays there."""

    @property
    def duration(self) -> float:
        """Time from its begin to its end [s]."""

    def at(self, elapsed: Array) -> LeaderReference:
        """The reference at times since its begin [s], shape (instant,); they are not negative."""


class Transfer:
    """The leader moves from one state to rest at a place, and turns meanwhile.

    Args:
        start: at the begin; its turn rate counts as zero.
        p_NB_N: of the place [m], shape (3,).
        yaw_NB: at the place [rad]; the leader turns the short way.
        limits: of speed, acceleration and turn rate.
    """

    def __init__(self, start: LeaderState, p_NB_N: Array, yaw_NB: float, limits: LeaderMotionConfig) -> None:
        self._position = Blend.within(
            start.p_NB_N[None], start.v_NB_N[None], p_NB_N[None], limits.speed_max, limits.acceleration_max
        )
        turn = np.array([[wrap_angle(yaw_NB - start.yaw_NB), 0.0, 0.0]])
        rate = limits.turn_rate_max  # reached within one second
        self._turn = Blend.within(np.zeros((1, 3)), np.zeros((1, 3)), turn, rate, rate)
        self._yaw_NB = start.yaw_NB

    @classmethod
    def to_rest(cls, start: LeaderState, limits: LeaderMotionConfig) -> Self:
        """The leader brakes along its velocity."""
        speed = float(np.linalg.norm(start.v_NB_N))
        # A cubic that comes to rest a third of the way that it would have flown: it decelerates evenly less.
        duration = 2.0 * speed / limits.acceleration_max
        return cls(start, start.p_NB_N + start.v_NB_N * (duration / 3.0), start.yaw_NB, limits)

    @property
    def duration(self) -> float:
        """See ``LeaderPath``."""
        return max(self._position.duration, self._turn.duration)

    def at(self, elapsed: Array) -> LeaderReference:
        """See ``LeaderPath``."""
        yaw_NB = self._yaw_NB + self._turn.at(elapsed)[0, :, 0]
        return LeaderReference(self._position.at(elapsed)[0], self._position.velocity_at(elapsed)[0], yaw_NB)


def braking(
    state: LeaderState, formations: Iterable[Mapping[str, Vector3]], config: ScenarioConfig
) -> Transfer:
    """The leader brakes, and comes to rest where all vehicles are inside the geofence, if there is one.

    Args:
        state: of the leader.
        formations: that the team has, and is to have: position of each follower relative to the leader [m].
        config: the scenario.
    """
    limits = config.controller.leader_motion
    stop = Transfer.to_rest(state, limits)
    if config.geofence is None:
        return stop
    place = stop.at(np.array([stop.duration])).p_NB_N[0]
    places = [(0.0, 0.0, 0.0), *(place for formation in formations for place in formation.values())]
    inside = config.geofence.inside(place, np.array(places) @ rotation_z(state.yaw_NB).T)
    return stop if np.array_equal(inside, place) else Transfer(state, inside, state.yaw_NB, limits)


class PhasesPath:
    """The phases of a scenario, flown from where the leader is: turned and moved as a whole.

    Args:
        config: the scenario.
        trajectory: of its phases; the motion of the last one continues after its end.
        start: at the begin, at rest.
    """

    def __init__(self, config: ScenarioConfig, trajectory: LeaderTrajectory, start: LeaderState) -> None:
        self._trajectory = trajectory
        self._origin_N = np.array(config.start.position)
        self._start = start
        self._turn = start.yaw_NB - config.start.yaw
        self._R = rotation_z(self._turn)
        self.duration = config.duration
        """See ``LeaderPath``, except that the leader may still move at the end."""

    def at(self, elapsed: Array) -> LeaderReference:
        """See ``LeaderPath``."""
        stamps_ns = np.minimum(
            np.rint(elapsed * NANOSECONDS_PER_SECOND).astype(np.int64), self._trajectory.last_ns
        )
        found = self._trajectory.at(stamps_ns)
        return LeaderReference(
            self._start.p_NB_N + (found.p_NB_N - self._origin_N) @ self._R.T,
            found.v_NB_N @ self._R.T,
            found.yaw_NB + self._turn,
        )
