"""Which measurements the team filter rejects, and when its belief or its model of the forces is out of date.

- A sighting that does not fit is rejected (chi-square), unless both vehicles of a pair agree.
- When everything that a vehicle sees, or everything that is seen of it, contradicts the belief for some time
  and always in the same way, the belief about that vehicle is wrong.
- The same holds for the leader's localization and the place of the whole team in the world.
- A change of the forces on a vehicle shows in its accelerometer: its disturbance may then change quickly.
"""

from dataclasses import dataclass

import numpy as np

from relform_controller.estimation.team_belief import Innovation
from relform_core.arrays import Array, Integers, Mask

SIGHTING_GATE = 16.27
"""99.9 % of the chi-square distribution with three degrees of freedom."""
FORCE_GATE = 25.0
"""For the squared accelerometer innovation of one instant."""
TORQUE_GATE = 25.0
"""For the squared innovation of tilt and rates of one instant."""
DRIFT_GATE = 20.0
"""For the slow average of accelerometer innovations."""
DRIFT_MEMORY = 0.7
"""Share of the old average in the new one."""
LOCALIZATION_GATE = 100.0
"""For the squared innovation of the leader's position and yaw. Far beyond chi-square bounds: only a jump is
rejected, not a drift of the team while it had no localization."""
SAME_CONTRADICTION = 0.3
"""A wrong belief contradicts the sightings in the same way at each instant, up to this part of the error."""
RUN = 10
"""After so many rejections in a row the belief counts as wrong."""


@dataclass(frozen=True, eq=False)
class Memory:
    """What the monitors remember from one instant to the next."""

    drift: Array
    """Slow average of the normalised accelerometer innovations, shape (vehicle, 3)."""
    runs: Integers
    """How many sightings in a row were rejected for the same contradiction, shape (pair,)."""
    contradictions: Array
    """Whitened innovations of the last rejected sightings, shape (pair, 3)."""
    misfits: int = 0
    """How many fixes of the localization in a row were rejected."""

    @classmethod
    def empty(cls, n_vehicles: int, n_pairs: int) -> "Memory":
        """Nothing has happened yet."""
        return cls(np.zeros((n_vehicles, 3)), np.zeros(n_pairs, dtype=np.int64), np.zeros((n_pairs, 3)))


def torque_changes(innovation: Innovation) -> Mask:
    """Which vehicles' tilt and rates show that their torques are not those of the model, shape (vehicle,)."""
    changed: Mask = innovation.torque_distances > TORQUE_GATE
    return changed


def force_changes(innovation: Innovation, drift: Array) -> tuple[Mask, Array]:
    """Which vehicles' accelerometers show that the forces on them have changed, and the new average.

    Args:
        drift: see ``Memory``.
    Returns:
        Shapes (vehicle,) and (vehicle, 3).
    """
    drift = DRIFT_MEMORY * drift + (1.0 - DRIFT_MEMORY) * innovation.forces
    drift_scale = (1.0 + DRIFT_MEMORY) / (1.0 - DRIFT_MEMORY)  # the average has this much less variance
    changed: Mask = ((innovation.forces**2).sum(axis=1) > FORCE_GATE) | (
        drift_scale * (drift**2).sum(axis=1) > DRIFT_GATE
    )
    drift[changed] = 0.0
    return changed, drift


def localization_misfits(innovation: Innovation) -> bool:
    """Whether the leader's localization contradicts the belief."""
    return bool(innovation.leader_distance[0] > LOCALIZATION_GATE)


def outlying_sightings(innovation: Innovation, seen: Mask, opposite: Integers) -> Mask:
    """Which sightings to reject, shape (pair,).

    Args:
        seen: which pairs have a sighting, shape (pair,).
        opposite: index of the pair with observer and target exchanged, shape (pair,).
    """
    outside = seen & (innovation.sighting_distances > SIGHTING_GATE)
    both = outside & outside[opposite]
    if both.any():  # two vehicles that contradict the belief in the same way are right, and the belief wrong
        outside &= ~(both & (_disagreement(innovation, opposite) < SIGHTING_GATE))
    return outside


def runs_of_rejections(
    innovation: Innovation, rejected: Mask, seen: Mask, memory: Memory
) -> tuple[Integers, Array]:
    """The new ``runs`` and ``contradictions`` of the memory; where nothing was seen they stay."""
    if not rejected.any() and not memory.runs.any():
        return memory.runs, memory.contradictions
    change = ((innovation.sightings - memory.contradictions) ** 2).sum(axis=1)
    size = (innovation.sightings**2).sum(axis=1)
    # Noise changes an innovation by twice its variance, a wrong belief by a part of the contradiction.
    is_same = change < 2.0 * SIGHTING_GATE + SAME_CONTRADICTION**2 * size
    runs = np.where(rejected, np.where(is_same, memory.runs, 0) + 1, np.where(seen, 0, memory.runs))
    return runs, np.where(rejected[:, None], innovation.sightings, memory.contradictions)


def misplaced_vehicles(runs: Integers, seen: Mask, pairs: tuple[tuple[int, int], ...]) -> list[int]:
    """The followers about which the belief is wrong.

    Args:
        runs: see ``Memory``.
        seen: which pairs have a sighting, shape (pair,).
        pairs: (observer, target) of each.
    """
    if not (runs >= RUN).any():
        return []
    contradicted = runs >= RUN
    found = []
    for vehicle in sorted({observer for observer, _ in pairs} - {0}):
        by_it = np.array([observer == vehicle for observer, _ in pairs]) & seen
        of_it = np.array([target == vehicle for _, target in pairs]) & seen
        if any(each.any() and contradicted[each].all() for each in (by_it, of_it)):
            found.append(vehicle)
    return found


def _disagreement(innovation: Innovation, opposite: Integers) -> Array:
    """What is left of two mutual sightings when the relative position is moved to fit both, shape (pair,)."""
    r = np.concatenate([innovation.sightings, innovation.sightings[opposite]], axis=1)
    by_target = innovation.sightings_by_target
    A = np.concatenate([by_target, -by_target[opposite]], axis=1)
    A = np.where(np.abs(A).sum(axis=(1, 2), keepdims=True) > 0.0, A, np.eye(6, 3))
    fit = np.linalg.pinv(A) @ r[:, :, None]
    rest: Array = ((r - (A @ fit)[:, :, 0]) ** 2).sum(axis=1)
    return rest
