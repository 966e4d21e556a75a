"""Distances from obstacles, by hand."""

import math

import numpy as np
import pytest

from relform_core.constraints_config import BoxObstacle, Obstacle, SphereObstacle
from relform_core.obstacles import clearance

BALL = SphereObstacle(kind="sphere", center_m=(1.0, -2.0, 0.5), radius_m=0.75)
BOX = BoxObstacle(kind="box", center_m=(5.0, 1.0, 2.0), size_m=(2.0, 4.0, 1.0), yaw_deg=90.0)
"""After its turn it reaches from (3, 0, 1.5) to (7, 2, 2.5)."""


@pytest.mark.parametrize(
    ("obstacle", "point", "distance"),
    [
        (BALL, (1.0, 1.0, 4.5), 5.0 - 0.75),
        (BALL, (1.2, -2.0, 0.5), 0.2 - 0.75),
        (BOX, (8.5, 1.3, 2.1), 1.5),
        (BOX, (4.0, -0.5, 2.4), 0.5),
        (BOX, (10.0, 6.0, 2.0), 5.0),
        (BOX, (2.0, -2.0, 4.5), 3.0),
        (BOX, (5.5, 1.2, 2.2), -0.3),
    ],
)
def test_one_obstacle(obstacle: Obstacle, point: tuple[float, ...], distance: float) -> None:
    assert clearance([obstacle], np.array(point)) == pytest.approx(distance)


def test_the_nearest_of_many_points() -> None:
    points = np.array([[[1.0, 1.0, 4.5], [8.5, 1.3, 2.1]]])
    np.testing.assert_allclose(clearance([BALL, BOX], points), [[math.sqrt(8.0), 1.5]])
    assert np.isinf(clearance([], points)).all()
