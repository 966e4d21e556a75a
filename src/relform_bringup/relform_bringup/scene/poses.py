"""Where the vehicles are in the world by what the controller knows of them."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from relform_core.arrays import Array
from relform_core.rotation import quaternion_from_yaw, quaternion_product, rotation_matrix
from relform_core.telemetry import TeamReference, TeamState

LEVEL = np.array([0.0, 0.0, 0.0, 1.0])


@dataclass(frozen=True, eq=False)
class Pose:
    """Of a body in the world."""

    p_NB_N: Array
    """[m], shape (3,)."""
    q_NB: Array
    """Unit quaternion (x, y, z, w), shape (4,)."""


def upright(p_NB_N: Array, yaw_NB: float) -> Pose:
    """The pose of {mc}: a place [m], shape (3,), and a yaw [rad]."""
    return Pose(p_NB_N, quaternion_from_yaw(yaw_NB))


def estimated_poses(state: TeamState, attitudes: Mapping[str, Array], leader: str) -> dict[str, Pose]:
    """The leader as it is estimated in the world, and each follower as it is estimated from the leader.

    Args:
        attitudes: of vehicles by their IMUs, q_NB of shape (4,), of which only roll and pitch are used, since
            the yaw of a follower's IMU has an unknown offset. A vehicle without one is drawn level.
        leader: its name.
    Returns:
        By vehicle name; empty if the state, of an older version, says nothing about the leader.
    """
    if state.leader is None:
        return {}
    base = upright(state.leader.p_NB_N, state.leader.yaw_NB)
    seen = {pair.target: pair for pair in state.pairs if pair.observer == leader}
    level = {leader: base} | {
        name: upright(beside(base, pair.p_B1B2_C1__est), state.leader.yaw_NB + pair.yaw_I1I2)
        for name, pair in seen.items()
    }
    return {
        name: Pose(pose.p_NB_N, quaternion_product(pose.q_NB, tilt_of(attitudes.get(name, LEVEL))))
        for name, pose in level.items()
    }


def wanted_places(reference: TeamReference, leader: str) -> dict[str, Pose]:
    """Where the leader should be, and each follower beside the leader's reference; by vehicle name."""
    base = upright(reference.p_NB_N, reference.yaw_NB)
    return {leader: base} | {
        target: Pose(beside(base, position), base.q_NB)
        for (observer, target), position in reference.formation.items()
        if observer == leader
    }


def beside(base: Pose, p_B1B2_C1: Array) -> Array:
    """The place in the world [m], shape (3,), that is at ``p_B1B2_C1`` from an upright pose."""
    place: Array = base.p_NB_N + rotation_matrix(base.q_NB) @ p_B1B2_C1
    return place


def tilt_of(q_NB: Array) -> Array:
    """q_CB: the roll and pitch of an attitude, without its yaw; shape (4,)."""
    x, y, z, w = q_NB.tolist()
    yaw = np.arctan2(2.0 * (w * z + x * y), w * w + x * x - y * y - z * z)
    return quaternion_product(quaternion_from_yaw(-yaw), q_NB)
