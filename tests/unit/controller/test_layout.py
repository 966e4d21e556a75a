"""The parts of a state, and the order of pairs."""

import numpy as np
import pytest

from relform_controller.ocp import layout


def test_the_parts_fill_the_state_without_overlap() -> None:
    state = np.arange(float(layout.N_STATE))
    parts = [state[part] for part in (layout.POSITION, layout.VELOCITY, layout.RPY, layout.RATE)]
    np.testing.assert_array_equal(np.concatenate(parts), state)
    np.testing.assert_array_equal(state[layout.RPY], state[[layout.ROLL, layout.PITCH, layout.YAW]])


@pytest.mark.parametrize("n_vehicles", [1, 2, 3, 5])
def test_every_vehicle_observes_every_other_once(n_vehicles: int) -> None:
    pairs = layout.ordered_pairs(n_vehicles)
    assert len(pairs) == len(set(pairs)) == n_vehicles * (n_vehicles - 1)
    assert all(i != j and {i, j} <= set(range(n_vehicles)) for i, j in pairs)
    assert list(pairs) == sorted(pairs)
