"""The problem that a scenario asks for: bounds, model, pairs and weights of the cost."""

import pytest

from relform_controller.ocp.problem import Ocp
from relform_controller.ocp.terms.formation import FORMATION
from relform_core.errors import ConfigError
from support.scenarios import paper_scenario, team_of


def ocp_with(*overrides: str) -> Ocp:
    return Ocp.from_config(paper_scenario(*overrides).config)


def test_bounds_are_on_the_thrust_of_a_rotor() -> None:
    ocp = ocp_with("vehicle.rotor_speed_min_rpm=1500", "vehicle.rotor_speed_max_rpm=5400")
    # 8.54858e-6 N s^2 times the square of 50 pi and of 180 pi rad/s
    assert ocp.thrust_min == pytest.approx(0.210928, rel=1e-5)
    assert ocp.thrust_max == pytest.approx(2.733632, rel=1e-5)


def test_dimensions_follow_the_team_and_the_horizon() -> None:
    ocp = ocp_with(*team_of(4), "controller.horizon_steps=7")
    assert (ocp.n_vehicles, ocp.n_stages, len(ocp.pairs)) == (4, 7, 12)
    assert (ocp.period, ocp.stage) == (0.05, 0.05)


def test_stages_may_be_longer_than_the_control_period() -> None:
    ocp = ocp_with("controller.stage_s=0.125")
    assert (ocp.period, ocp.stage) == (0.05, 0.125)
    with pytest.raises(ConfigError, match=r"stage_s 0\.04 must be at least period_s 0\.05"):
        ocp_with("controller.stage_s=0.04")


@pytest.mark.parametrize(
    ("choice", "expected"),
    [
        (
            "all",
            {(0, 1), (0, 2), (0, 3), (1, 0), (1, 2), (1, 3), (2, 0), (2, 1), (2, 3), (3, 0), (3, 1), (3, 2)},
        ),
        ("with_leader", {(0, 1), (0, 2), (0, 3), (1, 0), (2, 0), (3, 0)}),
        ("one_way", {(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)}),
    ],
)
def test_pairs_of_the_formation_cost(choice: str, expected: set[tuple[int, int]]) -> None:
    ocp = ocp_with(*team_of(4), f"controller.formation_pairs={choice}")
    assert {(i, j) for i, j in ocp.pairs if ocp.in_formation_cost(i, j)} == expected


@pytest.mark.parametrize("choice", ["with_leader", "one_way"])
def test_pairs_that_are_left_out_have_no_weight(choice: str) -> None:
    ocp = ocp_with(*team_of(4), f"controller.formation_pairs={choice}")
    weights = {pair: FORMATION.weight(ocp, ocp.weights, *pair) for pair in ocp.pairs}
    assert {pair for pair, weight in weights.items() if weight} == {
        pair for pair in ocp.pairs if ocp.in_formation_cost(*pair)
    }
