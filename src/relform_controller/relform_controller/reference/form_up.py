"""From where a team starts into its first formation: the followers move to their places and turn."""

import math
from dataclasses import dataclass

import numpy as np

from relform_controller.ocp.layout import ordered_pairs
from relform_controller.ocp.problem import TeamGeometry
from relform_core.arrays import Array
from relform_core.blend import smooth_step

HALF_TURN_TIME = 2.5
"""Time of a turn by 180 deg [s]; smaller turns take less, by the same largest acceleration."""


@dataclass(frozen=True, eq=False)
class StartPoses:
    """Where the leader is, and all vehicles relative to it, in team order; its own row is zero."""

    places: Array
    """In {mc} of the leader [m], shape (vehicle, 3)."""
    yaws: Array
    """Relative to the leader's, in (-pi, pi] [rad], shape (vehicle,)."""
    p_NB_N: Array
    """Of the leader in the world [m], shape (3,)."""
    yaw_NB: float
    """Of the leader in the world [rad]."""

    @classmethod
    def seen_by_leader(cls, geometry: TeamGeometry) -> "StartPoses":
        """The poses in a geometry."""
        of_leader = [pair for pair, (i, _) in enumerate(ordered_pairs(_n_vehicles(geometry))) if i == 0]
        places = np.concatenate([np.zeros((1, 3)), geometry.p_I1I2_I1[of_leader]])
        yaws = np.concatenate([[0.0], geometry.yaw_I1I2[of_leader]])
        return cls(places, yaws, geometry.p_NI_N, geometry.yaw_NI)


@dataclass(frozen=True, eq=False)
class YawRamp:
    """Yaws relative to the leader that turn to zero together, without a jump of their rates."""

    yaws: Array
    """At the start [rad], shape (vehicle,)."""
    duration: float
    """[s]; infinite: they stay."""

    @classmethod
    def at_rest(cls, yaws: Array) -> "YawRamp":
        """Yaws that stay."""
        return cls(yaws, math.inf)

    @classmethod
    def to_zero(cls, yaws: Array) -> "YawRamp":
        """Yaws that turn to zero, the short way."""
        largest = float(np.abs(yaws).max())
        return cls(yaws, HALF_TURN_TIME * math.sqrt(largest / math.pi))

    def is_over(self, elapsed: float) -> bool:
        """Whether all yaws are zero from a time since the start on [s]."""
        return elapsed >= self.duration

    def at(self, elapsed: Array) -> Array:
        """Yaws at times since the start [s], shape (instant,): [rad], shape (vehicle, instant)."""
        left: Array = 1.0 - smooth_step(elapsed, self.duration)
        return self.yaws[:, None] * left


def seen_by_turned(p_B1B2_C0: Array, yaws: Array) -> Array:
    """Relative positions in the {mc} of observers that are turned against the leader.

    Args:
        p_B1B2_C0: in {mc} of the leader [m], shape (pair, instant, 3).
        yaws: of the observers relative to the leader [rad], shape (pair, instant).
    Returns:
        p_B1B2_C1 [m], shape (pair, instant, 3).
    """
    cos, sin = np.cos(yaws), np.sin(yaws)
    x, y, z = np.moveaxis(p_B1B2_C0, -1, 0)
    return np.stack([cos * x + sin * y, cos * y - sin * x, z], axis=-1)


def _n_vehicles(geometry: TeamGeometry) -> int:
    return round(0.5 + math.sqrt(0.25 + len(geometry.yaw_I1I2)))  # n (n - 1) ordered pairs
