"""The start of any team: from perfect measurements along any connected graph, the truth."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from relform_controller.estimation.estimator import TeamEstimate
from relform_controller.ocp.frames import wrap_angles
from relform_controller.ocp.layout import ordered_pairs
from support.starts import estimator_of, measured, resting_team, seen_along
from support.world import relative_position_C


@st.composite
def connected_graphs(draw: st.DrawFn) -> tuple[int, list[tuple[int, int]]]:
    """Number of vehicles, and pairs that see each other."""
    n = draw(st.integers(2, 6))
    tree = [(draw(st.integers(0, later - 1)), later) for later in range(1, n)]
    others = [(i, j) for i in range(n) for j in range(i + 1, n) if (i, j) not in tree]
    return n, [*tree, *(edge for edge in others if draw(st.booleans()))]


@settings(max_examples=40, deadline=None)
@given(connected_graphs(), st.integers(0, 2**32 - 1))
def test_any_team_is_found(graph: tuple[int, list[tuple[int, int]]], seed: int) -> None:
    n, edges = graph
    team = resting_team(np.random.default_rng(seed), n)
    estimate = estimator_of(n).update(seen_along(measured(team), edges), {}, None)
    assert isinstance(estimate, TeamEstimate)
    expected = [relative_position_C(team[i], team[j]) for i, j in ordered_pairs(n)]
    np.testing.assert_allclose(estimate.geometry.p_I1I2_I1, expected, atol=1e-5)
    turns = np.array([team[j].yaw - team[i].yaw for i, j in ordered_pairs(n)])
    np.testing.assert_allclose(wrap_angles(estimate.geometry.yaw_I1I2 - turns), 0.0, atol=1e-5)
    assert estimate.covariances is not None
    assert np.linalg.eigvalsh(estimate.covariances.pairs).min() > 0.0
    assert np.linalg.eigvalsh(estimate.covariances.leader).min() > 0.0
