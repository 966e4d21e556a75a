"""The geometry that a belief implies, and how well it is known."""

import numpy as np

from relform_controller.estimation.team_belief import Belief
from relform_controller.estimation.team_geometry import covariances, states_and_geometry
from relform_controller.estimation.team_model import N_FILTER_STATE
from relform_controller.ocp import layout
from relform_controller.ocp.layout import ordered_pairs
from support.states import random_state

N = 3
PAIRS = ordered_pairs(N)


def random_belief(seed: int) -> Belief:
    generator = np.random.default_rng(seed)
    states = np.ones((N, N_FILTER_STATE))
    states[:, : layout.N_STATE] = [random_state(generator) for _ in range(N)]
    size = N * N_FILTER_STATE
    return Belief(states, 1e-6 * generator.normal(size=(size, size)))


def test_covariances_agree_with_many_draws_from_the_belief() -> None:
    belief = random_belief(4)
    _, geometry = states_and_geometry(belief)
    expected = covariances(belief, geometry)
    draws = np.random.default_rng(5).normal(size=(4000, belief.factor.shape[0])) @ belief.factor.T
    pairs, leaders = [], []
    for draw in draws:
        _, drawn = states_and_geometry(
            Belief(belief.states + draw.reshape(belief.states.shape), belief.factor)
        )
        yaws = np.angle(np.exp(1j * (drawn.yaw_I1I2 - geometry.yaw_I1I2)))
        pairs.append(np.column_stack([drawn.p_I1I2_I1 - geometry.p_I1I2_I1, yaws]))
        leaders.append([*(drawn.p_NI_N - geometry.p_NI_N), drawn.yaw_NI - geometry.yaw_NI])
    for pair in range(len(PAIRS)):
        found = np.cov(np.array(pairs)[:, pair].T)
        scale = np.sqrt(np.outer(*2 * [np.diag(expected.pairs[pair])]))
        np.testing.assert_allclose(found / scale, expected.pairs[pair] / scale, atol=0.1)
    scale = np.sqrt(np.outer(*2 * [np.diag(expected.leader)]))
    np.testing.assert_allclose(np.cov(np.array(leaders).T) / scale, expected.leader / scale, atol=0.1)


def test_the_leaders_own_error_does_not_show_in_the_pairs() -> None:
    """An error that all vehicles share leaves every relative position as it is."""
    belief = random_belief(6)
    shared = np.zeros((N, N_FILTER_STATE, 3))
    shared[:, layout.POSITION] = 5.0 * np.eye(3)
    factor = np.zeros_like(belief.factor)
    factor[:, :3] = shared.reshape(-1, 3)
    found = covariances(Belief(belief.states, factor), states_and_geometry(belief)[1])
    np.testing.assert_allclose(found.pairs, 0.0, atol=1e-12)
    np.testing.assert_allclose(np.diag(found.leader), [25.0, 25.0, 25.0, 0.0])
