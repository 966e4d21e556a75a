"""Laws of shapes of formations, for any number of vehicles."""

import math
from collections.abc import Callable

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from relform_core import shapes
from relform_core.arrays import Array

SHAPES: dict[str, Callable[[int, float], Array]] = {
    "line": shapes.line,
    "column": shapes.column,
    "circle": shapes.circle,
    "grid": shapes.grid,
    "sphere": shapes.sphere,
    "narrow v": lambda n, spacing: shapes.v(n, spacing, math.radians(60.0)),
    "wide v": lambda n, spacing: shapes.v(n, spacing, math.radians(140.0)),
    "grid of three columns": lambda n, spacing: shapes.grid(n, spacing, 3),
}


@given(
    st.sampled_from(sorted(SHAPES)),
    st.integers(2, 40),
    st.floats(0.3, 20.0),
    st.floats(-math.pi / 4.0, math.pi / 4.0),
)
def test_right_number_and_spacing_with_the_leader_in_front(
    shape: str, n_vehicles: int, spacing: float, slope: float
) -> None:
    level = SHAPES[shape](n_vehicles, spacing)
    places = shapes.sloped(level, slope)
    assert places.shape == (n_vehicles, 3)
    np.testing.assert_array_equal(places[0], 0.0)
    distances = np.linalg.norm(places[:, None] - places[None], axis=2)
    nearest = np.where(np.eye(n_vehicles, dtype=bool), np.inf, distances).min(axis=1)
    assert nearest.min() >= spacing * (1.0 - 1e-9)
    if shape != "sphere":  # where only the closest two are at the spacing
        np.testing.assert_allclose(nearest, spacing, rtol=0.12 if "grid" in shape else 1e-9)
    assert level[:, 0].max() <= 1e-9 * spacing
