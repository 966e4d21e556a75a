"""Condensing against the recursion that it eliminates."""

import numpy as np
import pytest

from relform_controller.ocp import layout
from relform_controller.solver.dense.condensing import condense


@pytest.mark.parametrize(("n_vehicles", "n_stages"), [(1, 1), (2, 4), (3, 7)])
def test_states_follow_the_linear_recursion(n_vehicles: int, n_stages: int) -> None:
    generator = np.random.default_rng(n_stages)
    A = generator.normal(size=(n_vehicles, n_stages, layout.N_STATE, layout.N_STATE)) / 3.0
    B = generator.normal(size=(n_vehicles, n_stages, layout.N_STATE, layout.N_INPUT))
    gaps = generator.normal(size=(n_vehicles, n_stages, layout.N_STATE))
    du = generator.normal(size=(n_vehicles, n_stages, layout.N_INPUT))
    dx0 = generator.normal(size=(n_vehicles, layout.N_STATE))

    maps = condense(A, B, gaps)
    assert maps.by_inputs.shape == (n_vehicles, n_stages + 1, layout.N_STATE, n_stages * layout.N_INPUT)
    for vehicle in range(n_vehicles):
        dx = dx0[vehicle]
        for k in range(n_stages + 1):
            by_inputs = maps.by_inputs[vehicle, k] @ du[vehicle].reshape(-1)
            by_initial = maps.by_initial[vehicle, k] @ dx0[vehicle]
            np.testing.assert_allclose(
                by_inputs + by_initial + maps.offset[vehicle, k], dx, rtol=1e-9, atol=1e-9
            )
            free = maps.free_response(dx0, np.ones((n_vehicles, layout.N_INPUT)))[vehicle, k]
            np.testing.assert_allclose(free + by_inputs, dx, rtol=1e-9, atol=1e-9)
            if k < n_stages:
                dx = A[vehicle, k] @ dx + B[vehicle, k] @ du[vehicle, k] + gaps[vehicle, k]


def test_inputs_do_not_change_earlier_states() -> None:
    generator = np.random.default_rng(0)
    A = generator.normal(size=(2, 5, layout.N_STATE, layout.N_STATE))
    B = generator.normal(size=(2, 5, layout.N_STATE, layout.N_INPUT))
    by_inputs = condense(A, B, np.zeros((2, 5, layout.N_STATE))).by_inputs
    for k in range(6):
        assert not by_inputs[:, k, :, k * layout.N_INPUT :].any()
