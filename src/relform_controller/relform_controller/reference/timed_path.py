"""A path of the leader through given points at given times, as a user's own planner sends it."""

import math
from collections.abc import Sequence

import numpy as np
from scipy.interpolate import CubicSpline

from relform_controller.reference.leader_path import LeaderState
from relform_controller.reference.trajectory import LeaderReference
from relform_core.arrays import Array
from relform_core.controller_config import LeaderMotionConfig
from relform_core.errors import ConfigError
from relform_core.spline_limits import broken_limit

START_TOLERANCE = 0.3
"""A path begins at most this far from the leader's reference [m]."""
POINTS_MAX = 10_000
DURATION_MAX = 3600.0
"""How long a requested path of the leader may take [s]: it is checked all along when it is asked for."""


class TimedPath:
    """A cubic spline through points, from the leader's velocity to rest.

    Before the first point the leader moves to it from where it is.

    Args:
        start: of the leader, at the begin.
        rows: time from now [s], x, y, z [m] and yaw [rad] of each point, shape (point, 5); a yaw that is NaN
            is that of the point before.
        limits: of speed, acceleration and turn rate.
    Raises:
        ConfigError: one line: what is wrong with the points, and with which.
    """

    def __init__(self, start: LeaderState, rows: Array, limits: LeaderMotionConfig) -> None:
        _check_rows(rows, start)
        yaws = np.unwrap([start.yaw_NB, *_filled(rows[:, 4], start.yaw_NB)])
        places = np.column_stack([[start.p_NB_N, *rows[:, 1:4]], yaws])
        ends = ((1, [*start.v_NB_N, 0.0]), (1, np.zeros(4)))
        self._places = CubicSpline([0.0, *rows[:, 0]], places, bc_type=ends)
        """x, y, z [m] and yaw [rad]."""
        self._rates = self._places.derivative()
        if (broken := broken_limit(self._places, limits)) is not None:
            raise ConfigError(f"trajectory is too fast: {broken}")

    @property
    def duration(self) -> float:
        """See ``LeaderPath``."""
        return float(self._places.x[-1])

    def at(self, elapsed: Array) -> LeaderReference:
        """See ``LeaderPath``."""
        times = np.minimum(elapsed, self.duration)
        places, rates = self._places(times), self._rates(times)
        return LeaderReference(places[:, :3], rates[:, :3], places[:, 3])


def _check_rows(rows: Array, start: LeaderState) -> None:
    if len(rows) < 2:
        raise ConfigError(f"trajectory needs at least 2 points (got {len(rows)})")
    if len(rows) > POINTS_MAX:
        raise ConfigError(f"trajectory may have at most {POINTS_MAX} points (got {len(rows)})")
    for point, row in enumerate(rows):
        if not np.isfinite(row[:4]).all() or math.isinf(row[4]):
            raise ConfigError(f"point {point} of the trajectory is not finite")
    if (first := float(rows[0, 0])) <= 0.0:
        raise ConfigError(f"trajectory begins in the past: {-first:.2f} s ago")
    if (last := float(rows[-1, 0])) > DURATION_MAX:
        raise ConfigError(f"trajectory takes {last:.0f} s, at most {DURATION_MAX:g} s are allowed")
    for point in np.flatnonzero(np.diff(rows[:, 0]) <= 0.0).tolist():
        raise ConfigError(
            f"times of a trajectory must increase: point {point + 1} is not after the one before"
        )
    if (apart := float(np.linalg.norm(rows[0, 1:4] - start.p_NB_N))) > START_TOLERANCE:
        raise ConfigError(
            f"trajectory begins {apart:.2f} m from the leader, at most {START_TOLERANCE:g} m are allowed: go "
            "there first"
        )


def _filled(yaws: Array, before: float) -> Array:
    """Yaws without NaN: one that is missing is that of the point before."""
    filled: list[float] = []
    for yaw in yaws.tolist():
        before = before if math.isnan(yaw) else yaw
        filled.append(before)
    return np.array(filled)


def rows_of(values: Sequence[float]) -> Array:
    """Rows of five numbers from a flat sequence, shape (point, 5).

    Raises:
        ConfigError: no whole number of rows.
    """
    if len(values) % 5:
        raise ConfigError(f"a trajectory has 5 numbers per point (got {len(values)} in all)")
    return np.array(values, dtype=np.float64).reshape(-1, 5)
