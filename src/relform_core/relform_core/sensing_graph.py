"""Which vehicles see each other: graphs over the vehicles of a team, as sets of index pairs (i < j)."""

from collections.abc import Iterable
from itertools import combinations, pairwise

import numpy as np

from relform_core.arrays import Array

Edges = frozenset[tuple[int, int]]
"""Pairs of vehicles i < j that see each other."""


def edges_of(pairs: Iterable[tuple[int, int]]) -> Edges:
    """The edges of pairs in any order."""
    return frozenset((min(pair), max(pair)) for pair in pairs)


def complete(n_vehicles: int) -> Edges:
    """All see all."""
    return edges_of(combinations(range(n_vehicles), 2))


def star(n_vehicles: int) -> Edges:
    """The leader and each follower see each other."""
    return edges_of((0, follower) for follower in range(1, n_vehicles))


def ring(n_vehicles: int) -> Edges:
    """Each sees its neighbours in team order; the last one and the leader are neighbours."""
    return edges_of(pairwise([*range(n_vehicles), 0]))


def nearest(places: Array, count: int) -> Edges:
    """Each and its nearest others see each other.

    Args:
        places: shape (vehicle, 3). Of others at the same distance the first in team order counts.
        count: of others, at least 1.
    """
    distances = np.linalg.norm(places[:, None] - places[None], axis=2).round(6)
    np.fill_diagonal(distances, np.inf)
    order = np.argsort(distances, axis=1, kind="stable")[:, : min(count, len(places) - 1)]
    return edges_of((vehicle, int(other)) for vehicle, others in enumerate(order) for other in others)


def unconnected(n_vehicles: int, edges: Edges) -> list[int]:
    """The vehicles to which no path leads from the leader."""
    reached = {0}
    for _ in range(n_vehicles):
        reached |= {vehicle for edge in edges if reached & set(edge) for vehicle in edge}
    return [vehicle for vehicle in range(n_vehicles) if vehicle not in reached]
