"""Every fault and its one-line description."""

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from relform_core.constraints_config import SphereObstacle
from relform_core.load import load_scenario
from relform_core.measurements import Odometry
from relform_sim.faults import find_fault

VEHICLE = load_scenario(Path(__file__).parents[3] / "config/scenarios/paper.yaml").config.vehicle
ZEROS = np.zeros((6, 6))


def team(**follower_1: Any) -> dict[str, Odometry]:
    """Three vehicles in good order, follower_1 with these changes."""
    q_NB = Rotation.from_euler("ZYX", [2.0, 0.5, -0.3]).as_quat()
    states = {
        name: Odometry(0, np.array(p_NB_N), q_NB, np.array([1.0, 2.0, 3.0]), np.ones(3), ZEROS, ZEROS)
        for name, p_NB_N in {
            "leader": (1.0, 2.0, 3.0),
            "follower_1": (0.0, 1.5, 2.5),
            "follower_2": (0.0, 2.5, 2.5),
        }.items()
    }
    states["follower_1"] = replace(states["follower_1"], **follower_1)
    return states


def test_no_fault() -> None:
    assert all(find_fault(VEHICLE, name, team()) is None for name in team())


@pytest.mark.parametrize(
    ("changes", "description"),
    [
        (
            {"p_NB_N": np.array([0.0, 2.5, 2.003])},
            "follower_1 collided with follower_2 (0.497 m apart, at least 0.5 m are needed)",
        ),
        (
            {"p_NB_N": np.array([0.0, 1.5, -0.02])},
            "follower_1 touched the ground (at a height of -0.02 m, above 0 is needed)",
        ),
        (
            {"q_NB": Rotation.from_euler("ZYX", [2.0, 0.3, math.radians(100.0)]).as_quat()},
            "follower_1 tilted by 100 deg (at most 85 deg are allowed)",
        ),
        (
            {"v_NB_B": np.array([math.nan, 0.0, 0.0])},
            "follower_1 has a state that is not finite: the simulation diverged",
        ),
        (
            {"w_NB_B": np.array([0.0, math.inf, 0.0])},
            "follower_1 has a state that is not finite: the simulation diverged",
        ),
    ],
)
def test_faults(changes: dict[str, Any], description: str) -> None:
    assert find_fault(VEHICLE, "follower_1", team(**changes)) == description
    assert find_fault(VEHICLE, "leader", team(**changes)) is None


def test_collision_with_an_obstacle() -> None:
    """follower_1 is at (0, 1.5, 2.5), 0.9 m from the centre of the ball."""
    near, far = (SphereObstacle(kind="sphere", center_m=(0.0, 0.6, 2.5), radius_m=r) for r in (0.7, 0.6))
    description = (
        "follower_1 collided with an obstacle (0.200 m from its surface, at least 0.25 m are needed)"
    )
    assert find_fault(VEHICLE, "follower_1", team(), [far, near]) == description
    assert find_fault(VEHICLE, "follower_1", team(), [far]) is None
    assert find_fault(VEHICLE, "leader", team(), [far, near]) is None


def test_both_vehicles_report_a_collision() -> None:
    states = team(p_NB_N=np.array([0.0, 2.5, 2.003]))
    assert find_fault(VEHICLE, "follower_2", states).startswith("follower_2 collided with follower_1 (0.497 ")


def test_a_collision_names_the_nearest_vehicle() -> None:
    states = team(p_NB_N=np.array([0.0, 2.3, 2.5]))
    states["leader"] = replace(states["leader"], p_NB_N=np.array([0.0, 2.0, 2.5]))
    assert "follower_1 collided with follower_2 (0.200 m" in find_fault(VEHICLE, "follower_1", states)


@pytest.mark.parametrize(("tilt_deg", "is_fault"), [(84.9, False), (85.1, True), (180.0, True)])
@pytest.mark.parametrize("yaw", [0.0, 1.3, -3.0])
def test_tilt_limit_does_not_depend_on_yaw(tilt_deg: float, is_fault: bool, yaw: float) -> None:
    attitude = (
        Rotation.from_euler("z", 0.7)
        * Rotation.from_rotvec(math.radians(tilt_deg) * np.array([0.6, 0.8, 0.0]))
        * Rotation.from_euler("z", yaw)
    )
    fault = find_fault(VEHICLE, "follower_1", team(q_NB=attitude.as_quat()))
    assert (fault is not None) == is_fault
