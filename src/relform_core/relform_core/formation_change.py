"""Changes of formation: how long they take, and whether vehicles come too close to each other on the way."""

import itertools
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from relform_core.arrays import Array
from relform_core.blend import Blend
from relform_core.formation_way import Separation, around, is_free, pairs, separations
from relform_core.phases_config import PhaseConfig
from relform_core.scenario_config import ScenarioConfig
from relform_core.schema import Vector3


@dataclass(frozen=True)
class TooClose:
    """Two vehicles would come too close to each other on the way."""

    phase: PhaseConfig | None
    """The phase that changes the formation; None: a request."""
    phase_index: int | None
    pair: tuple[str, str]
    separation: float
    """[m]"""
    needed: float
    """[m]"""

    def __str__(self) -> str:
        first, second = self.pair
        return (
            f"'{first}' and '{second}' would come within {self.separation:.3f} m of each other on the "
            f"way, at least {self.needed:.3f} m are needed"
        )


class FormationChanges:
    """The changes of formation that the phases of a scenario, or requests in flight, ask for."""

    def __init__(self, config: ScenarioConfig) -> None:
        self._config = config
        limits, bound = config.controller.formation_change, config.controller.constraints.separation
        self._separation = Separation(config.vehicle.separation_min, 0.0 if limits is None else limits.margin)
        self._may_cross = limits is None or (bound is not None and bound.min >= self._separation.least)
        """Whether ways may cross: older versions flew everything, and a separation constraint leads the
        vehicles around each other in flight."""
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

        Vehicles that would come too close on straight lines, or in one step, go around each other; see
        ``problem`` for where they cannot.

        Args:
            before: the change until now.
            elapsed: time since its start [s].
            formation: position of each follower relative to the leader [m].
            phase: the phase that changes the formation; None: a request.
        """
        target = self.places(formation)
        now = np.array([elapsed])
        start, velocity = before.at(now)[:, 0], before.velocity_at(now)[:, 0]
        limits = self._config.controller.formation_change
        if limits is None:  # a recording of an older version
            return Blend(start, np.zeros_like(start), target, self._config.controller.formation_ramp or 0.0)
        if phase is not None and phase.formation_step:
            step = Blend(start, np.zeros_like(start), target, 0.0)
            if self._may_cross or is_free(step, self._separation):
                return step
        straight = Blend.within(start, velocity, target, limits.speed_max, limits.acceleration_max)
        if self._may_cross or is_free(straight, self._separation):
            return straight
        return around(straight, limits, self._separation) or straight

    def problem(self, change: Blend, step: int) -> TooClose | None:
        """What makes a change, or a later one that the scenario makes after it, impossible.

        Args:
            change: that a request asks for.
            step: control step at which it starts.
        """
        if self._may_cross:
            return None
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
        found, needed = separations(change), self._separation.needed(change.start, change.target)
        if is_free(change, self._separation):
            return None
        pair = int(np.argmin(found - needed))
        first, second = (self._config.team.vehicles[each[pair]] for each in pairs(len(change.start)))
        index = None if phase is None else self._config.phases.index(phase)
        return TooClose(phase, index, (first, second), max(float(found[pair]), 0.0), float(needed[pair]))
