"""Errors of the team at each control step, from ground truth."""

from collections.abc import Sequence

import numpy as np

from relform_analysis.flight.log import FlightLog
from relform_core.arrays import Array
from relform_core.team_config import TeamConfig


def scored_pairs(team: TeamConfig) -> tuple[tuple[str, str], ...]:
    """Observer and target of the scored pairs: leader to each follower, each later follower to that before.

    With two followers these are the pairs of the paper: L to F1, L to F2, F2 to F1.
    """
    from_leader = [(team.leader, follower) for follower in team.followers]
    backwards = list(zip(team.followers[1:], team.followers[:-1], strict=True))
    return (*from_leader, *backwards)


def relative_positions(p_NB_N: Array, yaw_NB: Array) -> Array:
    """x^{mc_i}_{mb_j/mb_i} of all pairs (eqs. RelPos1-4 from the truth).

    Args:
        p_NB_N: positions [m], shape (..., n, 3).
        yaw_NB: yaws [rad], shape (..., n).
    Returns:
        p_BB_C [m], shape (..., n, n, 3), axes observer i, target j.
    """
    p_BB_N = p_NB_N[..., None, :, :] - p_NB_N[..., :, None, :]
    cos, sin = np.cos(yaw_NB)[..., :, None], np.sin(yaw_NB)[..., :, None]
    x, y, z = np.moveaxis(p_BB_N, -1, 0)
    return np.stack([cos * x + sin * y, cos * y - sin * x, z], axis=-1)


def yaw_of(q_NB: Array) -> Array:
    """Yaw of the Z-Y-X Euler angles [rad]; ``q_NB`` is (x, y, z, w), shape (..., 4)."""
    x, y, z, w = np.moveaxis(q_NB, -1, 0)
    yaw: Array = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    return yaw


def formation_errors(log: FlightLog, pairs: Sequence[tuple[str, str]]) -> Array:
    """|| x^{mc_i}_{mb_j/mb_i} - reference || of each pair at each control step [m], shape (K, pairs)."""
    p_BB_C = relative_positions(log.p_NB_N, yaw_of(log.q_NB))[log.tick_of_step]
    errors = np.linalg.norm(p_BB_C - log.p_BB_C__ref, axis=-1)
    index = {name: position for position, name in enumerate(log.vehicles)}
    return np.stack([errors[:, index[observer], index[target]] for observer, target in pairs], axis=-1)


def leader_errors(log: FlightLog) -> tuple[Array, Array]:
    """Distance of the leader from its reference [m] and magnitude of its yaw error [rad], shape (K,) each."""
    truth = log.tick_of_step
    position_error = np.linalg.norm(log.p_NB_N[truth, log.leader] - log.leader_p_NB_N__ref, axis=-1)
    return position_error, _angle_between(yaw_of(log.q_NB[truth, log.leader]), log.leader_yaw__ref)


def follower_yaw_errors(log: FlightLog) -> Array:
    """Magnitude of the yaw of each follower relative to the leader [rad], shape (K, followers).

    The paper: its followers keep the leader's yaw, too.
    """
    yaw = yaw_of(log.q_NB)[log.tick_of_step]
    return _angle_between(yaw[:, log.followers], yaw[:, [log.leader]])


def _angle_between(first: Array, second: Array) -> Array:
    difference = first - second
    return np.abs(np.arctan2(np.sin(difference), np.cos(difference)))
