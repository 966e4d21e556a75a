"""Shapes that viewers draw, by hand."""

import math

import numpy as np
import pytest

from relform_bringup.scene.poses import upright
from relform_bringup.scene.shapes import Kind, obstacle_shapes, target_shapes, team_shapes
from support.scenarios import paper_scenario

OBSTACLES = (
    "obstacles=[{kind: sphere, center_m: [30, 2, 3], radius_m: 0.5}, "
    "{kind: box, center_m: [30, -4, 1], size_m: [1, 2, 3], yaw_deg: 60}]"
)
CONFIG = paper_scenario(OBSTACLES, "controller=team", "sensing=star").config
EAST, NORTH = 0.0, math.radians(90.0)
POSES = {
    "leader": upright(np.array([1.0, 2.0, 3.0]), NORTH),
    "follower_1": upright(np.array([0.0, 1.0, 3.0]), EAST),
    "follower_2": upright(np.array([2.0, 1.0, 3.0]), EAST),
}


def test_arms_end_at_the_rotors_and_turn_with_the_vehicle() -> None:
    shapes = list(team_shapes(CONFIG, POSES))
    arms = next(shape for shape in shapes if shape.group == "vehicles" and shape.number == 0)
    arm = CONFIG.vehicle.arm_length
    assert arms.kind is Kind.LINE_LIST
    (back, front), (right, left) = arms.points.reshape(2, 2, 3)
    assert front == pytest.approx([1.0, 2.0 + arm, 3.0])
    assert back == pytest.approx([1.0, 2.0 - arm, 3.0])
    assert left == pytest.approx([1.0 - arm, 2.0, 3.0])
    assert right == pytest.approx([1.0 + arm, 2.0, 3.0])


def test_lines_lead_from_the_leader_to_those_that_it_may_see() -> None:
    (links,) = (shape for shape in team_shapes(CONFIG, POSES) if shape.group == "links")
    assert links.points.reshape(2, 2, 3) == pytest.approx(
        np.array([[[1, 2, 3], [0, 1, 3]], [[1, 2, 3], [2, 1, 3]]], dtype=float)
    )


def test_only_what_is_known_is_drawn() -> None:
    shapes = list(team_shapes(CONFIG, {"follower_2": POSES["follower_2"]}))
    assert {(shape.group, shape.number) for shape in shapes} == {
        ("vehicles", 2), ("collision", 2), ("names", 2),
    }  # fmt: skip
    (name,) = (shape for shape in shapes if shape.group == "names")
    assert name.text == "follower_2"
    assert name.pose.p_NB_N[2] > 3.0 + CONFIG.vehicle.collision_radius


def test_numbers_are_unique_in_a_group() -> None:
    shapes = [*team_shapes(CONFIG, POSES), *target_shapes(CONFIG, POSES), *obstacle_shapes(CONFIG)]
    assert len({(shape.group, shape.number) for shape in shapes}) == len(shapes)


def test_obstacles_have_their_size_and_yaw() -> None:
    sphere, box = obstacle_shapes(CONFIG)
    assert (sphere.kind, sphere.size) == (Kind.SPHERE, (1.0, 1.0, 1.0))
    assert sphere.pose.p_NB_N.tolist() == [30.0, 2.0, 3.0]
    assert (box.kind, tuple(box.size)) == (Kind.CUBE, (1.0, 2.0, 3.0))
    assert box.pose.q_NB == pytest.approx([0.0, 0.0, 0.5, math.sqrt(0.75)])


def test_targets_are_where_the_vehicles_should_be() -> None:
    targets = list(target_shapes(CONFIG, POSES))
    assert [shape.pose.p_NB_N.tolist() for shape in targets] == [[1, 2, 3], [0, 1, 3], [2, 1, 3]]
