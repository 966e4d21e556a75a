"""Paths that are thinned out and bounded."""

import numpy as np

from relform_bringup.scene.poses import Pose, upright
from relform_bringup.scene.trail import Due, Trail


def at(x: float) -> Pose:
    return upright(np.array([x, 0.0, 0.0]), 0.3)


def test_something_is_due_once_in_each_period() -> None:
    due = Due(50)
    stamps = (0, 10, 49, 50, 60, 120, 149, 150)
    assert [stamp for stamp in stamps if due(stamp)] == [0, 50, 120, 150]


def test_something_is_due_again_when_time_goes_back() -> None:
    due = Due(50)
    assert [due(stamp) for stamp in (500, 510, 20, 30)] == [True, False, True, False]


def test_a_trail_keeps_the_newest_poses_with_their_instants() -> None:
    trail = Trail(spacing_ns=100, length=3)
    for stamp in range(0, 600, 50):
        trail.add(stamp, at(stamp / 100.0))
    assert [(stamp, pose.p_NB_N[0]) for stamp, pose in trail] == [(300, 3.0), (400, 4.0), (500, 5.0)]


def test_a_new_trail_begins_when_time_goes_back() -> None:
    """A bag is played in a loop, or another flight begins."""
    trail = Trail(spacing_ns=100, length=3)
    for stamp in (1000, 1100, 0, 100):
        trail.add(stamp, at(float(stamp)))
    assert [stamp for stamp, _ in trail] == [0, 100]
