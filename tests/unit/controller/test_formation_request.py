"""Formations asked for by name, as a shape or place by place; who takes which place; refusals and answers."""

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from relform_controller.reference.formation_request import FormationRequest, answer, assigned
from relform_core.blend import Blend
from relform_core.errors import ConfigError
from relform_core.schema import Vector3
from support.scenarios import paper_scenario

CONFIG = paper_scenario().config
PRESENT = np.array([[0.0, 0.0, 0.0], [-1.0, -0.5, -0.5], [-1.0, 0.5, -0.5]])
EXPLICIT: dict[str, Vector3] = {"follower_1": (-1.5, 0.75, 0.25), "follower_2": (-1.25, -0.5, -0.5)}


def test_a_formation_by_name() -> None:
    wide = FormationRequest(name="wide").formation(CONFIG)
    assert wide == {"follower_1": (-1.0, -0.75, -0.5), "follower_2": (-1.0, 0.75, -0.5)}


def test_a_formation_as_a_shape() -> None:
    """Behind the leader, and 30 degrees lower."""
    request = FormationRequest(shape="{kind: column, spacing_m: 1.2, slope_deg: 30}")
    found = request.formation(CONFIG)
    assert found == {"follower_1": (-1.0392, 0.0, -0.6), "follower_2": (-2.0785, 0.0, -1.2)}


def test_a_formation_place_by_place() -> None:
    other_order = dict(reversed(EXPLICIT.items()))
    assert list(FormationRequest(places=other_order).formation(CONFIG).items()) == list(EXPLICIT.items())


def test_followers_that_may_take_any_place_take_the_near_ones() -> None:
    """Each place is across: as they are, the followers would fly 1.25 m and 1 m to the other side."""
    found = assigned(EXPLICIT, PRESENT[1:])
    assert found == {"follower_1": EXPLICIT["follower_2"], "follower_2": EXPLICIT["follower_1"]}


def test_a_sum_of_squares_spreads_the_way() -> None:
    """Each moves by 1 m (1 + 1 + 1), and not the last one alone by 3 m (9)."""
    line: dict[str, Vector3] = {"a": (1.0, 0.0, 0.0), "b": (2.0, 0.0, 0.0), "c": (3.0, 0.0, 0.0)}
    present = np.array([[2.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    assert assigned(line, present) == {"a": line["c"], "b": line["b"], "c": line["a"]}


points = st.tuples(*[st.floats(-3.0, 3.0, width=16)] * 3)


@given(st.lists(points, min_size=4, max_size=4), st.lists(points, min_size=4, max_size=4))
def test_no_other_assignment_is_shorter(present: list[Vector3], places: list[Vector3]) -> None:
    names = ("a", "b", "c", "d")
    taken = assigned(dict(zip(names, places, strict=True)), np.array(present))

    def cost(chosen: tuple[Vector3, ...]) -> float:
        return float(((np.array(chosen) - np.array(present)) ** 2).sum())

    assert sorted(taken.values()) == sorted(places)
    assert cost(tuple(taken[name] for name in names)) <= min(map(cost, itertools.permutations(places))) + 1e-9


@pytest.mark.parametrize(
    ("request_", "problem"),
    [
        (FormationRequest(), "set_formation needs exactly one of name, shape and formation (got none)"),
        (
            FormationRequest(name="wide", places=EXPLICIT),
            "set_formation needs exactly one of name, shape and formation (got name and formation)",
        ),
        (FormationRequest(name="wyde"), "unknown formation 'wyde', known are initial, wide"),
        (
            FormationRequest(shape="{kind: square, spacing_m: 1}"),
            "shape: kind: must be one of 'line', 'column', 'v', 'circle', 'grid', 'sphere' (got 'square')",
        ),
        (FormationRequest(shape="{spacing_m: 1}"), "shape: kind: missing key"),
        (FormationRequest(shape="{kind: v}"), "shape: spacing_m: missing key"),
        (
            FormationRequest(shape="{kind: v, spacing_m: -1, turn: 2}"),
            "shape: spacing_m: must be greater than 0 (got -1); shape: turn: unknown key",
        ),
        (FormationRequest(shape="v"), "shape: must hold a mapping of keys to values at its top level"),
        (
            FormationRequest(shape="{kind: v"),
            "shape:1:9: not valid YAML: expected ',' or '}'",
        ),
    ],
)
def test_refusals(request_: FormationRequest, problem: str) -> None:
    with pytest.raises(ConfigError) as caught:
        request_.formation(CONFIG)
    assert str(caught.value).startswith(problem)
    assert "\n" not in str(caught.value)


def test_answers() -> None:
    way = Blend(PRESENT, np.zeros((3, 3)), PRESENT + 0.5, duration=2.44)
    assert answer(12, way, None) == "applies from step 12 on, takes 2.4 s"
    around = Blend(PRESENT, np.zeros((3, 3)), PRESENT, 3.0, detours=np.ones((3, 3, 3)))
    assert answer(7, around, EXPLICIT) == (
        "applies from step 7 on, takes 3.0 s, vehicles fly around each other; "
        "follower_1 to [-1.5, 0.75, 0.25], follower_2 to [-1.25, -0.5, -0.5]"
    )
