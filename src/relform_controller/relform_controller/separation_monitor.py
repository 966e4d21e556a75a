"""Watches the distances of the vehicles: as measured, as estimated, and as the plan predicts them."""

import itertools
from collections import deque
from collections.abc import Mapping, Sequence

import numpy as np

from relform_controller.ocp import layout
from relform_controller.ocp.frames import rotation_z
from relform_controller.ocp.problem import TeamGeometry
from relform_core.arrays import Array
from relform_core.measurements import TeamMeasurements
from relform_core.names import SeparationLevel
from relform_core.sensors.range_bearing import RANGE_BEARING
from relform_core.separation_config import SeparationConfig
from relform_core.telemetry import Nearest, SeparationReport

STEPS_KEPT = 2
"""Control steps whose ranges count, the present one included."""
WITNESSES = 2
"""Ranges that must say so before two vehicles count as measured to be close: one alone may be an outlier."""


class SeparationMonitor:
    """The distances of one team.

    Args:
        vehicles: names in team order.
        config: distances at which there is a warning, or an emergency.
        stage: length of a stage of the plan [s].
    """

    def __init__(self, vehicles: Sequence[str], config: SeparationConfig, stage: float) -> None:
        self._vehicles = vehicles
        self._config = config
        self._stage = stage
        self._order = {name: index for index, name in enumerate(vehicles)}
        self._ranges: deque[Mapping[tuple[int, int], list[float]]] = deque(maxlen=STEPS_KEPT)
        """Ranges that arrived in the last steps [m], by unordered pair."""

    def update(
        self, measurements: TeamMeasurements, now: TeamGeometry, planned: TeamGeometry, states: Array
    ) -> SeparationReport:
        """What is known in a control step.

        Args:
            measurements: that arrived in it.
            now: where the vehicles are.
            planned: where the {mi} frames of the plan lie.
            states: of the plan, shape (vehicle, stage 0..N, N_STATE).
        """
        measured = self._measured(measurements)
        ahead = _distances(planned, states[:, :, layout.POSITION])
        stage = int(np.argmin(ahead.min(axis=0)))
        predicted = self._nearest(ahead[:, stage])
        estimated = self._nearest(_distances(now, np.zeros((len(self._vehicles), 1, 3)))[:, 0])
        near = min(estimated.distance, np.inf if measured is None else measured.distance)
        if near < self._config.emergency:
            level = SeparationLevel.EMERGENCY
        elif min(near, predicted.distance) < self._config.warning:
            level = SeparationLevel.WARNING
        else:
            level = SeparationLevel.OK
        return SeparationReport(level, estimated, measured, predicted, stage * self._stage)

    def _measured(self, measurements: TeamMeasurements) -> Nearest | None:
        """The nearest two by the ranges of the last steps."""
        arrived: dict[tuple[int, int], list[float]] = {}
        for name, of_vehicle in measurements.by_vehicle.items():
            for bearings in of_vehicle.arrived(RANGE_BEARING):
                for target, seen in bearings.by_target.items():
                    i, j = sorted((self._order[name], self._order[target]))
                    arrived.setdefault((i, j), []).append(seen.range)
        self._ranges.append(arrived)
        nearest: Nearest | None = None
        for pair in itertools.combinations(range(len(self._vehicles)), 2):
            ranges = sorted(itertools.chain.from_iterable(step.get(pair, ()) for step in self._ranges))
            if len(ranges) >= WITNESSES and (nearest is None or ranges[WITNESSES - 1] < nearest.distance):
                nearest = Nearest(self._names(pair), ranges[WITNESSES - 1])
        return nearest

    def _nearest(self, distances: Array) -> Nearest:
        """The nearest two by the distances of all unordered pairs, shape (pair,)."""
        pair = int(np.argmin(distances))
        i_and_j = list(itertools.combinations(range(len(self._vehicles)), 2))[pair]
        return Nearest(self._names(i_and_j), float(distances[pair]))

    def _names(self, pair: tuple[int, int]) -> tuple[str, str]:
        return self._vehicles[pair[0]], self._vehicles[pair[1]]


def _distances(geometry: TeamGeometry, p_IB_I: Array) -> Array:
    """Distances of the vehicles at some instants [m], shape (unordered pair, instant).

    Args:
        geometry: where the {mi} frames lie.
        p_IB_I: positions in them [m], shape (vehicle, instant, 3).
    """
    n = len(p_IB_I)
    distances = [
        np.linalg.norm(
            geometry.p_I1I2_I1[index] + p_IB_I[j] @ rotation_z(float(geometry.yaw_I1I2[index])).T - p_IB_I[i],
            axis=1,
        )
        for index, (i, j) in enumerate(layout.ordered_pairs(n))
        if i < j
    ]
    return np.array(distances)
