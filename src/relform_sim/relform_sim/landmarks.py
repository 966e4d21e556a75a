"""Where a vehicle is, by what should stay where it is: its neighbours, and for the leader its localization.

Optic flow alone lets a vehicle drift by a decimetre or more in 5 s. While a team takes off, hovers and lands,
every vehicle holds its horizontal place, so that each is a landmark for those that see it.
"""

import math
from collections.abc import Iterator, Mapping

import numpy as np

from relform_core.arrays import Array
from relform_sim.pilot import Readings

SIGHT_STD = 0.1
"""Of a place by the sight of a neighbour, which may move a little itself [m]."""
LOCALIZATION_STD = 0.05
"""Of a place by the localization [m]."""
GATE = 0.4
"""A landmark that disagrees by more than this has moved, or is an outlier [m]."""
SETTLING = 0.2
"""Share by which a new measurement changes the anchor of a landmark, while the vehicle stands."""
_WORLD = ""
"""The landmark that the localization is about."""


class Landmarks:
    """The landmarks of one vehicle: each has an anchor, what is measured of it minus the place."""

    def __init__(self) -> None:
        self._anchors: dict[str, Array] = {}

    def settle(self, readings: Readings, R_NB: Array, place: Array) -> None:
        """Average the anchors, while the vehicle stands at a place: its horizontal position, shape (2,)."""
        for name, measured in _measured(readings, R_NB).items():
            before = self._anchors.get(name, measured - place)
            self._anchors[name] = before + SETTLING * (measured - place - before)

    def forget(self) -> None:
        """Forget all anchors, because the vehicle or its neighbours move."""
        self._anchors.clear()

    def places(self, readings: Readings, R_NB: Array, place: Array) -> Iterator[tuple[Array, float]]:
        """Measured horizontal positions, shape (2,), with their variances.

        A landmark without an anchor gets one by the estimated place, shape (2,).
        """
        for name, measured in _measured(readings, R_NB).items():
            found = measured - self._anchors.setdefault(name, measured - place)
            if math.dist(found, place) < GATE:
                yield found, (LOCALIZATION_STD if name == _WORLD else SIGHT_STD) ** 2


def _measured(readings: Readings, R_NB: Array) -> Mapping[str, Array]:
    """By landmark, horizontal position of the vehicle relative to it, or in the world, shape (2,)."""
    measured = {} if readings.place_N is None else {_WORLD: readings.place_N[:2]}
    for name, sight in readings.sights.items():
        level = math.cos(sight.elevation)
        direction_B = (
            level * math.cos(sight.azimuth),
            level * math.sin(sight.azimuth),
            math.sin(sight.elevation),
        )
        measured[name] = -sight.range * (R_NB[:2] @ np.array(direction_B))
    return measured
