"""Which measurements the team filter rejects, and when its model of the forces is out of date.

- Sightings that do not fit are rejected one by one (chi-square), unless both vehicles of a pair agree.
- A change of the forces on a vehicle shows in its accelerometer: its disturbance may then change quickly.
"""

import numpy as np
import numpy.typing as npt

from relform_controller.estimation import team_model
from relform_controller.estimation.team_filter import Innovation, squared_distances
from relform_core.arrays import Array

SIGHTING_GATE = 16.27
"""99.9 % of the chi-square distribution with three degrees of freedom."""
FORCE_GATE = 25.0
"""For the squared accelerometer innovation of one instant."""
DRIFT_GATE = 20.0
"""For the slow average of accelerometer innovations."""
DRIFT_MEMORY = 0.7
"""Share of the old average in the new one."""

Mask = npt.NDArray[np.bool_]


def force_changes(innovation: Innovation, drift: Array) -> tuple[Mask, Array]:
    """Which vehicles' accelerometers show that the forces on them have changed, and the new average.

    Args:
        drift: slow average of the normalised accelerometer innovations, shape (vehicle, 3).
    Returns:
        Shapes (vehicle,) and (vehicle, 3).
    """
    rows = innovation.own_rows[:, team_model.SPECIFIC_FORCE_ROWS]
    whitened = innovation.own[:, team_model.SPECIFIC_FORCE_ROWS]
    roots = np.linalg.cholesky(np.eye(3) + rows @ rows.swapaxes(1, 2))
    normalised = np.linalg.solve(roots, whitened[:, :, None])[:, :, 0]
    drift = DRIFT_MEMORY * drift + (1.0 - DRIFT_MEMORY) * normalised
    drift_scale = (1.0 + DRIFT_MEMORY) / (1.0 - DRIFT_MEMORY)  # the average has this much less variance
    changed: Mask = ((normalised**2).sum(axis=1) > FORCE_GATE) | (
        drift_scale * (drift**2).sum(axis=1) > DRIFT_GATE
    )
    drift[changed] = 0.0
    return changed, drift


def outlying_sightings(innovation: Innovation, seen: Mask, opposite: npt.NDArray[np.intp]) -> Mask:
    """Which sightings to reject, shape (pair,).

    Args:
        seen: which pairs have a sighting, shape (pair,).
        opposite: index of the pair with observer and target exchanged, shape (pair,).
    """
    distances = squared_distances(innovation.sightings, innovation.sighting_rows)
    outside = seen & (distances > SIGHTING_GATE)
    # Two vehicles that contradict the belief in the same way are right, and the belief is wrong.
    agree = outside & outside[opposite] & (_disagreement(innovation, opposite) < SIGHTING_GATE)
    rejected: Mask = outside & ~agree
    return rejected


def _disagreement(innovation: Innovation, opposite: npt.NDArray[np.intp]) -> Array:
    """What is left of two mutual sightings when the relative position is moved to fit both, shape (pair,)."""
    r = np.concatenate([innovation.sightings, innovation.sightings[opposite]], axis=1)
    by_position = innovation.sightings_by_position
    A = np.concatenate([by_position, -by_position[opposite]], axis=1)
    A = np.where(np.abs(A).sum(axis=(1, 2), keepdims=True) > 0.0, A, np.eye(6, 3))
    fit = np.linalg.pinv(A) @ r[:, :, None]
    rest: Array = ((r - (A @ fit)[:, :, 0]) ** 2).sum(axis=1)
    return rest
