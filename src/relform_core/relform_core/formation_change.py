"""Changes of formation: how long they take, and whether vehicles come too close to each other on the way."""

import itertools
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from relform_core.arrays import Array
from relform_core.blend import Blend
from relform_core.phases_config import PhaseConfig
from relform_core.scenario_config import ScenarioConfig
from relform_core.schema import Vector3

_ROUNDING = 1e-9
"""Tolerance [m]: rounding must not refuse vehicles at the smallest distance that is allowed."""
_SAMPLES = 61
"""Number of points on a curved path."""


@dataclass(frozen=True)
class TooClose:
    """Two vehicles would come closer than the collision distance on the way."""

    phase: PhaseConfig | None
    """The phase that changes the formation; None: a request."""
    phase_index: int | None
    pair: tuple[str, str]
    separation: float
    """[m]"""
    separation_min: float
    """[m]"""

    def __str__(self) -> str:
        first, second = self.pair
        return (
            f"'{first}' and '{second}' would come within {self.separation:.3f} m of each other on the "
            f"way, at least {self.separation_min:.3f} m are needed"
        )


class FormationChanges:
    """The changes of formation that the phases of a scenario, or requests in flight, ask for."""

    def __init__(self, config: ScenarioConfig) -> None:
        self._config = config
        self.by_step: Mapping[int, PhaseConfig] = {
            step: phase
            for step, (before, phase) in zip(
                config.phase_starts[1:], itertools.pairwise(config.phases), strict=True
            )
            if phase.formation != before.formation
        }
        """The phases that change the formation, by their first control step."""

    def places(self, formation: Mapping[str, Vector3]) -> Array:
        """Places of all vehicles in team order, in {mc} of the leader [m], shape (vehicle, 3)."""
        team = self._config.team
        by_vehicle = {team.leader: (0.0, 0.0, 0.0), **formation}
        return np.array([by_vehicle[name] for name in team.vehicles])

    def at_rest(self, formation: Mapping[str, Vector3]) -> Blend:
        """No change: the team stays in this formation."""
        return Blend.at_rest(self.places(formation))

    def begin(
        self,
        before: Blend,
        elapsed: float,
        formation: Mapping[str, Vector3],
        phase: PhaseConfig | None = None,
    ) -> Blend:
        """The change to a formation, of all places in {mc} of the leader.

        Args:
            before: the change until now.
            elapsed: time since its start [s].
            formation: position of each follower relative to the leader [m].
            phase: the phase that changes the formation; None: a request.
        """
        target = self.places(formation)
        start, velocity = before.at(np.array([elapsed]))[:, 0], before.velocity_at(elapsed)
        limits = self._config.controller.formation_change
        if limits is None:  # a recording of an older version
            return Blend(start, np.zeros_like(start), target, self._config.controller.formation_ramp or 0.0)
        if phase is not None and phase.formation_step:
            return Blend(start, np.zeros_like(start), target, 0.0)
        return Blend.within(start, velocity, target, limits.speed_max, limits.acceleration_max)

    def problem(self, change: Blend, step: int) -> TooClose | None:
        """What makes a change, or a later one that the scenario makes after it, impossible.

        Args:
            change: that a request asks for.
            step: control step at which it starts.
        """
        if self._config.controller.formation_change is None:  # older versions flew everything
            return None
        separation = self._config.controller.constraints.separation
        if separation is not None and separation.min >= self._config.vehicle.separation_min:
            return None  # the vehicles fly around each other
        if problem := self._too_close(change, None):
            return problem
        for next_step, phase in self.by_step.items():
            if next_step > step:
                elapsed = (next_step - step) * self._config.controller.period
                formation = self._config.formations[phase.formation]
                change, step = self.begin(change, elapsed, formation, phase), next_step
                if problem := self._too_close(change, phase):
                    return problem
        return None

    def scenario_problem(self) -> TooClose | None:
        """What makes a change of formation between two phases of the scenario impossible."""
        first = self._config.formations[self._config.phases[0].formation]
        return self.problem(self.at_rest(first), 0)

    def _too_close(self, change: Blend, phase: PhaseConfig | None) -> TooClose | None:
        names, separation_min = self._config.team.vehicles, self._config.vehicle.separation_min
        if change.straight:
            path = np.stack([change.start, change.target], axis=1)
        else:
            path = change.at(np.linspace(0.0, change.duration, _SAMPLES))
        for i, j in itertools.combinations(range(len(names)), 2):
            separation = _closest_to_origin(path[j] - path[i])
            if separation < separation_min - _ROUNDING:
                index = None if phase is None else self._config.phases.index(phase)
                return TooClose(phase, index, (names[i], names[j]), separation, separation_min)
        return None


def _closest_to_origin(points: Array) -> float:
    """Smallest distance of a polyline from the origin [m]; ``points`` has shape (point, 3)."""
    start, along = points[:-1], np.diff(points, axis=0)
    squared = np.maximum((along**2).sum(axis=1), np.finfo(np.float64).tiny)
    share = np.clip(-(start * along).sum(axis=1) / squared, 0.0, 1.0)
    return float(np.linalg.norm(start + along * share[:, None], axis=1).min())
