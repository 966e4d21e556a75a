"""The recent poses of one thing, and where it was in between."""

from bisect import bisect_left
from collections import deque
from dataclasses import dataclass

import numpy as np

from relform_core.arrays import Array

SAMPLES_MAX = 64
"""Poses that are kept."""


@dataclass(frozen=True, eq=False)
class Pose:
    """A pose in {n} at one instant."""

    stamp_ns: int
    p_NB_N: Array
    """[m], shape (3,)."""
    q_NB: Array
    """(x, y, z, w), shape (4,)."""


def turned(yaw: float, p: Array) -> Array:
    """R_z(yaw) p: from a control frame {mc} with this yaw [rad] into the world; p of shape (..., 3) [m]."""
    c, s = np.cos(yaw), np.sin(yaw)
    in_world: Array = p @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    return in_world


class Track:
    """The newest poses, in the order of their stamps."""

    def __init__(self) -> None:
        self._poses: deque[Pose] = deque(maxlen=SAMPLES_MAX)

    def __bool__(self) -> bool:
        return bool(self._poses)

    def clear(self) -> None:
        """Forget all poses."""
        self._poses.clear()

    @property
    def newest(self) -> Pose:
        """The pose with the newest stamp; there must be one."""
        return self._poses[-1]

    def add(self, pose: Pose) -> None:
        """Add a pose. An older one than before is of another flight, which replaces the poses so far."""
        if self._poses and pose.stamp_ns <= self._poses[-1].stamp_ns:
            if pose.stamp_ns == self._poses[-1].stamp_ns:
                return
            self._poses.clear()
        self._poses.append(pose)

    def at(self, stamp_ns: int) -> Pose:
        """The pose at an instant, interpolated; before the first and after the last pose these."""
        later = bisect_left(self._poses, stamp_ns, key=lambda pose: pose.stamp_ns)
        if later == 0:
            return self._poses[0]
        if later == len(self._poses):
            return self._poses[-1]
        a, b = self._poses[later - 1], self._poses[later]
        share = (stamp_ns - a.stamp_ns) / (b.stamp_ns - a.stamp_ns)
        q_b = b.q_NB if a.q_NB @ b.q_NB >= 0.0 else -b.q_NB  # the shorter way round
        q = a.q_NB + share * (q_b - a.q_NB)
        return Pose(stamp_ns, a.p_NB_N + share * (b.p_NB_N - a.p_NB_N), q / np.linalg.norm(q))

    def between(self, after_ns: int, until_ns: int) -> list[Pose]:
        """The poses with stamps in (after, until]."""
        return [pose for pose in self._poses if after_ns < pose.stamp_ns <= until_ns]
