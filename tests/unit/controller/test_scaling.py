"""Scales of the cost: exactly one for three Hummingbirds, and by hand for other vehicles and teams."""

import dataclasses

import numpy as np
import pytest

from relform_controller.ocp.model import RigidBody
from relform_controller.ocp.problem import Ocp
from relform_controller.ocp.scaling import (
    HUMMINGBIRD,
    formation_scale,
    leader_scale,
    thrust_scale,
    torque_scale,
)
from relform_core.controller_config import FormationPairs
from support.scenarios import paper_scenario, team_of

PAPER = Ocp.from_config(paper_scenario().config)
TWICE = RigidBody(1.432, (0.014, 0.014, 0.024), 0.18, HUMMINGBIRD.torque_per_thrust)
"""Two Hummingbirds in one, in mass and inertia."""


def test_every_scale_is_exactly_one_for_the_papers_team() -> None:
    assert PAPER.body == HUMMINGBIRD
    assert formation_scale(PAPER) == leader_scale(PAPER) == 1.0
    np.testing.assert_array_equal(torque_scale(HUMMINGBIRD), np.ones(3))
    np.testing.assert_array_equal(thrust_scale(HUMMINGBIRD), np.eye(4))


def test_twice_the_vehicle_needs_twice_the_thrust() -> None:
    np.testing.assert_allclose(torque_scale(TWICE), [0.5, 0.5, 0.5], rtol=1e-15)
    np.testing.assert_allclose(thrust_scale(TWICE), 0.5 * np.eye(4), atol=1e-15)


def test_scaled_thrusts_accelerate_a_hummingbird_alike() -> None:
    """Of another shape too: arms half as long, turned about x by 1 N more on the left."""
    body = RigidBody(0.358, (0.0035, 0.0014, 0.012), 0.09, HUMMINGBIRD.torque_per_thrust)
    found = thrust_scale(body) @ [0.0, 1.0, 0.0, 0.0]
    # Force per mass is doubled, roll unchanged (half the arm, half the inertia), yaw unchanged.
    force, roll, yaw = 2.0, 1.0, -1.0
    expected = [
        force / 4 + yaw / 4,
        force / 4 + roll / 2 - yaw / 4,
        force / 4 + yaw / 4,
        force / 4 - roll / 2 - yaw / 4,
    ]
    np.testing.assert_allclose(found, expected, atol=1e-15)
    # Pitch: half the arm, a fifth of the inertia.
    found = thrust_scale(body) @ [-1.0, 0.0, 1.0, 0.0]
    np.testing.assert_allclose(found, [-2.5, 0.0, 2.5, 0.0], atol=1e-15)


@pytest.mark.parametrize(
    ("pairs", "n_vehicles", "expected"),
    [
        ("all", 2, 2.0),
        ("all", 5, 0.5),
        ("all", 8, 2.0 / 7.0),
        ("one_way", 3, 1.0),
        ("one_way", 8, 2.0 / 7.0),
        ("with_leader", 3, 1.0),
        ("with_leader", 5, 5.0 / 6.0),  # 4 of 3 over 8 of 5: the ordered pairs with the leader, per vehicle
    ],
)
def test_formation_weights_by_the_terms_per_vehicle(
    pairs: FormationPairs, n_vehicles: int, expected: float
) -> None:
    ocp = Ocp.from_config(paper_scenario(*team_of(n_vehicles)).config)
    assert formation_scale(dataclasses.replace(ocp, formation_pairs=pairs)) == expected


@pytest.mark.parametrize(("n_vehicles", "expected"), [(2, 2.0 / 3.0), (6, 2.0), (8, 8.0 / 3.0)])
def test_leader_weights_by_the_size_of_the_team(n_vehicles: int, expected: float) -> None:
    assert leader_scale(Ocp.from_config(paper_scenario(*team_of(n_vehicles)).config)) == expected
