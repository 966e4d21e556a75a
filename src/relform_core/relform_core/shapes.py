"""Shapes of formations: the places of any number of vehicles, no two of them closer than a spacing.

Every function returns places relative to the leader, the leader's own first, in {mc} of the leader: x
forward, y left, z up [m]; shape (vehicle, 3). The leader flies in front, in a line in the middle.
"""

import math

import numpy as np

from relform_core.arrays import Array


def line(n_vehicles: int, spacing: float) -> Array:
    """Side by side, followers in turns to the right and to the left of the leader."""
    y = spacing * _in_turns(n_vehicles)
    return np.stack([np.zeros(n_vehicles), y, np.zeros(n_vehicles)], axis=1)


def _in_turns(n_vehicles: int) -> Array:
    """0, -1, 1, -2, 2 and so on: the leader in the middle, and followers in turns to its right and left."""
    number = np.arange(n_vehicles)
    turns: Array = np.where(number % 2 == 1, -1.0, 1.0) * ((number + 1) // 2)
    return turns


def column(n_vehicles: int, spacing: float) -> Array:
    """One behind the other."""
    return np.outer(np.arange(n_vehicles), [-spacing, 0.0, 0.0])


def v(n_vehicles: int, spacing: float, opening: float) -> Array:
    """Two arms behind the leader, followers in turns in the right and the left one.

    Args:
        opening: angle between the arms [rad], at least 60 degrees.
    """
    along = spacing * _in_turns(n_vehicles)
    x, y = -np.abs(along) * math.cos(0.5 * opening), along * math.sin(0.5 * opening)
    return np.stack([x, y, np.zeros(n_vehicles)], axis=1)


def circle(n_vehicles: int, spacing: float) -> Array:
    """A level circle with all vehicles on it, in clockwise order as seen from above."""
    radius = 0.5 * spacing / math.sin(math.pi / n_vehicles)
    angle = -2.0 * math.pi / n_vehicles * np.arange(n_vehicles)
    x, y = radius * (np.cos(angle) - 1.0), radius * np.sin(angle)
    return np.stack([x, y, np.zeros(n_vehicles)], axis=1)


def grid(n_vehicles: int, spacing: float, columns: int | None = None) -> Array:
    """Rows, filled from the front; a row that is not full is centred.

    Args:
        columns: vehicles in a full row; None: the grid is as square as possible.
    """
    width = math.isqrt(n_vehicles - 1) + 1 if columns is None else columns
    rows = []
    for row, first in enumerate(range(0, n_vehicles, width)):
        in_row = min(width, n_vehicles - first)
        y = spacing * (np.arange(in_row) - 0.5 * (in_row - 1))
        rows.append(np.stack([np.full(in_row, -spacing * row), y, np.zeros(in_row)], axis=1))
    points = np.concatenate(rows)
    leader = (min(width, n_vehicles) - 1) // 2
    places: Array = np.concatenate([points[[leader]], np.delete(points, leader, axis=0)]) - points[leader]
    return places


def sphere(n_vehicles: int, spacing: float) -> Array:
    """Spread over a sphere on a spiral from front to back; the closest two are at the spacing."""
    number = np.arange(n_vehicles)
    x = 1.0 - (2.0 * number + 1.0) / n_vehicles
    angle = math.pi * (3.0 - math.sqrt(5.0)) * number  # the golden angle
    across = np.sqrt(1.0 - x**2)
    points = np.stack([x, across * np.cos(angle), across * np.sin(angle)], axis=1)
    distances = np.linalg.norm(points[:, None] - points[None], axis=2)
    closest = distances[~np.eye(n_vehicles, dtype=bool)].min()
    places: Array = spacing / closest * (points - points[0])
    return places


def sloped(places: Array, slope: float) -> Array:
    """The same shape, inclined: what is behind the leader is lower by this angle [rad]."""
    c, s = math.cos(slope), math.sin(slope)
    turned: Array = places @ np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
    return turned
