"""Sensing graphs against graph searches of SciPy, and their laws."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from relform_core import sensing_graph


@given(st.integers(2, 12), st.sets(st.tuples(st.integers(0, 11), st.integers(0, 11)), max_size=20))
def test_unconnected_vehicles(n_vehicles: int, pairs: set[tuple[int, int]]) -> None:
    pairs = {(i, j) for i, j in pairs if i != j and max(i, j) < n_vehicles}
    rows, columns = zip(*pairs, strict=True) if pairs else ((), ())
    matrix = coo_matrix((np.ones(len(pairs)), (rows, columns)), (n_vehicles, n_vehicles))
    _, labels = connected_components(matrix, directed=False)
    expected = [vehicle for vehicle in range(n_vehicles) if labels[vehicle] != labels[0]]
    assert sensing_graph.unconnected(n_vehicles, sensing_graph.edges_of(pairs)) == expected


@given(st.integers(2, 12))
def test_numbers_of_edges(n: int) -> None:
    assert len(sensing_graph.complete(n)) == n * (n - 1) // 2
    assert len(sensing_graph.star(n)) == n - 1
    assert len(sensing_graph.ring(n)) == (n if n > 2 else 1)


@given(st.integers(3, 12), st.integers(1, 4), st.integers(0, 2**32 - 1))
def test_nearest_others(n: int, count: int, seed: int) -> None:
    places = np.random.default_rng(seed).uniform(-3.0, 3.0, (n, 3))
    count = min(count, n - 1)
    _, others = cKDTree(places).query(places, count + 1)
    expected = {(min(i, j), max(i, j)) for i in range(n) for j in others[i, 1:].tolist()}
    assert sensing_graph.nearest(places, count) == expected
