"""A path of the leader through given points: its curve, and what is refused."""

import math
import re
from typing import Any

import numpy as np
import pytest

from relform_controller.reference.leader_path import LeaderState
from relform_controller.reference.timed_path import TimedPath, rows_of
from relform_core.controller_config import LeaderMotionConfig
from relform_core.errors import ConfigError

LIMITS = LeaderMotionConfig(speed_max_m_s=2.0, acceleration_max_m_s2=2.0, turn_rate_max_deg_s=90.0)
START = LeaderState(np.array([1.0, 2.0, 1.5]), np.array([0.3, 0.0, 0.0]), 0.5)
NAN = math.nan
ROWS = np.array(
    [
        [1.0, 1.2, 2.0, 1.5, NAN],
        [3.0, 2.0, 3.0, 2.0, 0.6],
        [5.0, 3.5, 3.3, 2.0, 1.0],
    ]
)


def changed(row: int, column: int, value: float) -> np.ndarray:
    rows = ROWS.copy()
    rows[row, column] = value
    return rows


def test_it_passes_the_points_and_ends_at_rest() -> None:
    path = TimedPath(START, ROWS, LIMITS)
    assert path.duration == 5.0
    found = path.at(np.array([0.0, 1.0, 3.0, 5.0, 8.0]))
    assert found.p_NB_N == pytest.approx(np.array([START.p_NB_N, *ROWS[:, 1:4], ROWS[-1, 1:4]]))
    assert found.v_NB_N[0] == pytest.approx(START.v_NB_N)
    assert found.v_NB_N[3:] == pytest.approx(np.zeros((2, 3)), abs=1e-12)
    assert found.yaw_NB == pytest.approx([0.5, 0.5, 0.6, 1.0, 1.0])


def test_velocity_is_the_derivative() -> None:
    path = TimedPath(START, ROWS, LIMITS)
    times = np.linspace(0.01, 4.99, 57)
    h = 1e-5
    numeric = (path.at(times + h).p_NB_N - path.at(times - h).p_NB_N) / (2.0 * h)
    assert path.at(times).v_NB_N == pytest.approx(numeric, abs=1e-6)


def test_yaw_goes_the_short_way() -> None:
    start = LeaderState.at_rest(START.p_NB_N, 3.0)
    rows = np.array([[1.0, 1.0, 2.0, 1.5, -3.1], [3.0, 2.0, 2.0, 1.5, -2.9]])
    yaw = TimedPath(start, rows, LIMITS).at(np.array([1.0, 3.0])).yaw_NB
    assert yaw == pytest.approx([math.tau - 3.1, math.tau - 2.9])


@pytest.mark.parametrize(
    ("rows", "says"),
    [
        (ROWS[:1], "trajectory needs at least 2 points (got 1)"),
        (changed(1, 2, math.inf), "point 1 of the trajectory is not finite"),
        (changed(0, 0, -0.25), "trajectory begins in the past: 0.25 s ago"),
        (changed(2, 0, 3.0), "times of a trajectory must increase: point 2 is not after the one before"),
        (changed(-1, 0, 2e9), "trajectory takes 2000000000 s, at most 3600 s are allowed"),
        (changed(0, 1, 1.9), "trajectory begins 0.90 m from the leader, at most 0.3 m are allowed: go"),
        (changed(2, 1, 9.0), "trajectory is too fast: speed "),
        (changed(1, 2, 4.2), "trajectory is too fast: acceleration "),
        (changed(2, 4, 3.6), "trajectory is too fast: turn rate "),
    ],
)  # fmt: skip
def test_refused(rows: Any, says: str) -> None:
    with pytest.raises(ConfigError, match=re.escape(says)):
        TimedPath(START, rows, LIMITS)


def test_rows_have_five_numbers() -> None:
    assert rows_of(range(10)).tolist() == [[0, 1, 2, 3, 4], [5, 6, 7, 8, 9]]
    with pytest.raises(ConfigError, match=re.escape("a trajectory has 5 numbers per point (got 7 in all)")):
        rows_of(range(7))
