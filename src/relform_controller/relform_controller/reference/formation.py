"""The formation reference: which shape the team shall have, and how a new one is blended in."""

import itertools
import math
from collections.abc import Mapping

import numpy as np

from relform_controller.ocp.layout import ordered_pairs
from relform_controller.reference.trajectory import smooth_step
from relform_core.arrays import Array
from relform_core.errors import ConfigError
from relform_core.scenario_config import ScenarioConfig
from relform_core.schema import Vector3


class FormationSchedule:
    """The formation of each phase, or the one that was set by hand since.

    A reference is the position of every target in {mc} of its observer, for equal yaws: shape (pair, 3) [m].
    """

    def __init__(self, config: ScenarioConfig) -> None:
        self._vehicles = config.team.vehicles
        self._pairs = ordered_pairs(len(self._vehicles))
        self._config = config
        self._period = config.controller.period
        self._ramp = config.controller.formation_ramp
        self._by_step = _formation_starts(config)
        self.by_follower: Mapping[str, Vector3] = config.formations[config.phases[0].formation]
        """The present formation: position of each follower relative to the leader [m]."""
        self._target = self._pair_positions(self.by_follower)
        self._previous = self._target
        self._changed_at = -math.inf
        self._requested: Mapping[str, Vector3] | None = None

    def request(self, formation: Mapping[str, Vector3]) -> None:
        """Fly another formation from the next step on, until the scenario changes it.

        Args:
            formation: position of each follower relative to the leader [m].
        Raises:
            ConfigError: the team cannot fly it; the message says why.
        """
        if problem := self._config.formation_problem(formation):
            raise ConfigError(f"formation {problem}")
        self._requested = dict(formation)

    def advance(self, step: int) -> None:
        """Apply what the scenario or a request changes at this control step."""
        formation = self._by_step.get(step) if self._requested is None else self._requested
        self._requested = None
        if formation is not None:
            self._previous = self.reference(step, 1)[:, 0]
            self.by_follower = formation
            self._target = self._pair_positions(formation)
            self._changed_at = step

    @property
    def target(self) -> Array:
        """The present formation without its ramp, shape (pair, 3)."""
        return self._target

    def reference(self, step: int, n_instants: int) -> Array:
        """What to track at instants ``step`` ..., a new formation blended in; shape (pair, instant, 3)."""
        steps_since_change = np.arange(step, step + n_instants, dtype=np.float64) - self._changed_at
        since_change = steps_since_change * self._period
        share = smooth_step(since_change, self._ramp)[:, None]
        return self._previous[:, None] + (self._target - self._previous)[:, None] * share

    def _pair_positions(self, formation: Mapping[str, Vector3]) -> Array:
        places = np.array([(0.0, 0.0, 0.0), *(formation[name] for name in self._vehicles[1:])])
        return np.array([places[j] - places[i] for i, j in self._pairs])


def _formation_starts(config: ScenarioConfig) -> dict[int, Mapping[str, Vector3]]:
    """The formation of each phase that changes it, by the control step at which the phase starts."""
    return {
        step: config.formations[phase.formation]
        for step, (before, phase) in zip(
            config.phase_starts[1:], itertools.pairwise(config.phases), strict=True
        )
        if phase.formation != before.formation
    }
