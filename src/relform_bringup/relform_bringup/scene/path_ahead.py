"""The path of the leader's reference that is still to come."""

import numpy as np

from relform_bringup.scene.poses import Pose, upright
from relform_controller.reference.trajectory import LeaderTrajectory
from relform_core.scenario_config import ScenarioConfig
from relform_core.telemetry import TeamReference

TOLERANCE = 1e-6
"""Difference of position [m] and velocity [m/s] from the scenario's path that rounding explains."""


class PathAhead:
    """The rest of the scenario's path, as long as the controller follows it.

    The mission starts later than the flight if the start has to wait. So the place on the path is found by
    position and velocity; where the path stands still, it is the earliest that fits.
    """

    def __init__(self, config: ScenarioConfig) -> None:
        self._period_ns = config.period_ns
        n_instants = round(config.duration / config.controller.period) + 1  # the flight may last longer
        path = LeaderTrajectory(config, n_extra=0).at(np.arange(n_instants) * config.period_ns)
        self._path = path
        self._states = np.concatenate([path.p_NB_N, path.v_NB_N], axis=1)
        self._lag = 0
        """Steps from the start of the flight to that of the mission."""

    def after(
        self, step: int, reference: TeamReference, spacing_ns: int, length: int
    ) -> list[tuple[int, Pose]]:
        """Poses to come with their instants [ns] in the flight; empty if the reference is not on the path.

        Args:
            step: of the reference.
            reference: what the controller tracks in this step.
            spacing_ns: time from one pose to the next.
            length: largest number of poses.
        """
        place = self._place(step, reference)
        if place is None:
            return []
        stride = max(1, spacing_ns // self._period_ns)
        places = range(place + stride, len(self._states), stride)[:length]
        return [
            (
                (each + self._lag) * self._period_ns,
                upright(self._path.p_NB_N[each], float(self._path.yaw_NB[each])),
            )
            for each in places
        ]

    def _place(self, step: int, reference: TeamReference) -> int | None:
        """Index on the path; None: none."""
        wanted = np.concatenate([reference.p_NB_N, reference.v_NB_N])
        place = step - self._lag
        if not 0 <= place < len(self._states) or not _equal(self._states[place], wanted):
            distances = np.linalg.norm(self._states - wanted, axis=1)
            place = int(np.argmin(distances))
            if not _equal(self._states[place], wanted):
                return None
            self._lag = step - place
        return place


def _equal(state: np.ndarray, wanted: np.ndarray) -> bool:
    return bool(np.abs(state - wanted).max() < TOLERANCE)
