"""How far points are from the obstacles of a scenario."""

from collections.abc import Sequence

import numpy as np

from relform_core.arrays import Array
from relform_core.constraints_config import BoxObstacle, Obstacle, SphereObstacle


def clearance(obstacles: Sequence[Obstacle], p_N: Array) -> Array:
    """Distance from the nearest surface, negative inside [m]; infinite without obstacles.

    Args:
        obstacles: of the world.
        p_N: points in the world [m], shape (..., 3).
    """
    nearest = np.full(p_N.shape[:-1], np.inf)
    for obstacle in obstacles:
        nearest = np.minimum(nearest, _distance(obstacle, p_N))
    return nearest


def _distance(obstacle: Obstacle, p_N: Array) -> Array:
    from_center = p_N - np.array(obstacle.center)
    distance: Array
    match obstacle:
        case SphereObstacle():
            distance = np.linalg.norm(from_center, axis=-1) - obstacle.radius
        case BoxObstacle():
            cosine, sine = np.cos(obstacle.yaw), np.sin(obstacle.yaw)
            x, y, z = np.moveaxis(from_center, -1, 0)
            in_box = np.stack([cosine * x + sine * y, cosine * y - sine * x, z], axis=-1)
            beyond = np.abs(in_box) - 0.5 * np.array(obstacle.size)
            outside = np.linalg.norm(np.maximum(beyond, 0.0), axis=-1)
            distance = outside + np.minimum(beyond.max(axis=-1), 0.0)
    return distance
