"""Sensing graphs of a scenario, and what is wrong with those that it cannot have."""

import pytest

from relform_core.errors import ConfigError
from support.scenarios import PAPER, paper_scenario

FIVE = (
    "controller=team",
    "team.followers=4",
    "formations_m={initial: {kind: v, spacing_m: 1.0}, wide: {kind: v, spacing_m: 1.5}}",
)
"""A V: the leader, then the right arm (1, 3) and the left one (2, 4)."""


@pytest.mark.parametrize(
    ("sensing", "seen"),
    [
        ("complete", "1234 0234 0134 0124 0123"),
        ("star", "1234 0 0 0 0"),
        ("ring", "14 02 13 24 03"),
        ("{kind: nearest, count: 1}", "12 03 04 1 2"),
        ("{kind: pairs, pairs: [[follower_4, leader], [leader, follower_1], [follower_2, follower_3], "
         "[follower_3, follower_4]]}", "14 0 3 24 03"),
    ],
)  # fmt: skip
def test_who_sees_whom(sensing: str, seen: str) -> None:
    config = paper_scenario(*FIVE, f"sensing={sensing}").config
    vehicles = config.team.vehicles
    expected = {
        observer: tuple(vehicles[int(digit)] for digit in digits)
        for observer, digits in zip(vehicles, seen.split(), strict=True)
    }
    assert config.targets_of == expected


def test_nearest_others_at_the_same_distance_count_in_team_order() -> None:
    line = "formations_m={initial: {kind: line, spacing_m: 1}, wide: {kind: line, spacing_m: 1.5}}"
    config = paper_scenario("controller=team", line, "sensing={kind: nearest, count: 1}").config
    assert config.targets_of["leader"] == ("follower_1", "follower_2")


def test_the_paper_has_a_complete_graph() -> None:
    assert paper_scenario().config.targets_of["follower_1"] == ("leader", "follower_2")


@pytest.mark.parametrize(
    ("sensing", "problem"),
    [
        (
            "{kind: pairs, pairs: [[leader, follower_1], [follower_3, follower_4]]}",
            "sensing 'pairs' connects 2 of 5 vehicles, all must be connected: no chain of vehicles that see "
            "each other leads from 'leader' to 'follower_2'",
        ),
        (
            "{kind: pairs, pairs: [[leader, wing]]}",
            "sensing.pairs names the unknown vehicle 'wing', known are leader, follower_1, follower_2, "
            "follower_3, follower_4",
        ),
        (
            "{kind: pairs, pairs: [[follower_1, follower_1]]}",
            "sensing.pairs pairs 'follower_1' with itself, two vehicles are needed",
        ),
    ],
)
def test_a_graph_that_the_team_cannot_have(sensing: str, problem: str) -> None:
    with pytest.raises(ConfigError) as caught:
        paper_scenario(*FIVE, f"sensing={sensing}")
    assert str(caught.value).startswith(f"{PAPER} with --set ")
    assert str(caught.value).endswith(f": {problem}")


def test_raw_feedback_measures_all_pairs() -> None:
    with pytest.raises(ConfigError, match=r"sensing 'star' leaves out 'follower_1' and 'follower_2', but "):
        paper_scenario("sensing=star")


@pytest.mark.parametrize(
    ("override", "problem"),
    [
        (
            "sensing=web",
            "sensing.kind: must be one of 'complete', 'star', 'ring', 'nearest', 'pairs' (got 'web')",
        ),
        (
            "sensing={kind: nearest, count: 0}",
            "sensing.count: must be greater than or equal to 1 (got 0)",
        ),
        ("sensing={kind: nearest}", "sensing.count: missing key"),
        ("team.followers=2.5", "team.followers: must be a list (got 2.5)"),
        ("team.followers=0", "team.followers: a number of followers must be 1 to 63 (got 0)"),
        (
            "formations_m.initial={kind: cube, spacing_m: 1}",
            "formations_m.initial.kind: must be one of "
            "'line', 'column', 'v', 'circle', 'grid', 'sphere' (got 'cube')",
        ),
        (
            "formations_m.wide={kind: v, spacing_m: 1, opening_deg: 50}",
            "formations_m.wide.opening_deg: must be greater than or equal to 60 (got 50)",
        ),
        ("formations_m.wide={kind: grid}", "formations_m.wide.spacing_m: missing key"),
        (
            "formations_m.wide={kind: line, spacing_m: 1, columns: 3}",
            "formations_m.wide.columns: unknown key",
        ),
    ],
)
def test_bad_values(override: str, problem: str) -> None:
    with pytest.raises(ConfigError) as caught:
        paper_scenario(*FIVE, override)
    assert str(caught.value) == f"--set {problem}"


def test_a_spacing_below_the_collision_distance() -> None:
    with pytest.raises(ConfigError) as caught:
        paper_scenario(*FIVE, "formations_m.wide={kind: grid, spacing_m: 0.4}")
    assert str(caught.value).endswith(
        "formation 'wide' is impossible: 'leader' and 'follower_1' are 0.400 m apart, "
        "at least 0.500 m are needed"
    )
