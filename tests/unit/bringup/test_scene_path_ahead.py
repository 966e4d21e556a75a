"""The rest of the leader's path, found by where its reference is."""

import dataclasses

import numpy as np
import pytest

from relform_bringup.scene.path_ahead import PathAhead
from relform_controller.reference.trajectory import LeaderTrajectory
from relform_core.telemetry import TeamReference
from support.scenarios import FROM_GROUND, paper_scenario

CONFIG = paper_scenario("start.yaw_deg=50").config
STEP_NS = CONFIG.period_ns
SPACING_NS = 2 * STEP_NS
MOVING = 60
"""A step on the straight."""


def reference(place: int) -> TeamReference:
    path = LeaderTrajectory(CONFIG, 0).at(np.array([place * STEP_NS]))
    return TeamReference("B", path.p_NB_N[0], path.v_NB_N[0], float(path.yaw_NB[0]), {})


@pytest.mark.parametrize("late_steps", [0, 7])
def test_poses_to_come_have_the_instants_of_the_flight(late_steps: int) -> None:
    """The mission starts later than the flight if the start has to wait."""
    ahead = PathAhead(CONFIG)
    poses = ahead.after(MOVING + late_steps, reference(MOVING), SPACING_NS, length=3)
    assert [stamp // STEP_NS - late_steps for stamp, _ in poses] == [MOVING + 2, MOVING + 4, MOVING + 6]
    for (_, pose), place in zip(poses, (62, 64, 66), strict=True):
        assert pose.p_NB_N == pytest.approx(reference(place).p_NB_N, abs=1e-12)
        assert pose.q_NB[2] == pytest.approx(np.sin(0.5 * reference(place).yaw_NB))


def test_the_path_ends_with_the_flight() -> None:
    ahead = PathAhead(CONFIG)
    last = CONFIG.n_steps
    assert [stamp // STEP_NS for stamp, _ in ahead.after(last - 5, reference(last - 5), SPACING_NS, 9)] == [
        last - 3,
        last - 1,
    ]
    assert ahead.after(last, reference(last), SPACING_NS, 9) == []


def test_a_reference_that_is_not_on_the_path_has_none_ahead() -> None:
    """The leader was sent elsewhere."""
    elsewhere = dataclasses.replace(reference(MOVING), p_NB_N=np.array([5.0, -5.0, 3.0]))
    slower = dataclasses.replace(reference(MOVING), v_NB_N=np.zeros(3))
    ahead = PathAhead(CONFIG)
    assert ahead.after(MOVING, elsewhere, SPACING_NS, 9) == []
    assert ahead.after(MOVING, slower, SPACING_NS, 9) == []
    assert len(ahead.after(MOVING, reference(MOVING), SPACING_NS, 9)) == 9


def test_a_flight_from_the_ground_reaches_the_path_later() -> None:
    config = paper_scenario("start.yaw_deg=50", FROM_GROUND).config
    assert config.n_steps > CONFIG.n_steps
    (stamp, _), *_ = PathAhead(config).after(200 + MOVING, reference(MOVING), SPACING_NS, length=2)
    assert stamp // STEP_NS == 200 + MOVING + 2
