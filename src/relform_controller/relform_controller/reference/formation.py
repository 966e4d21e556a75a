"""The formation reference: which shape the team shall have, and how a new one is blended in."""

import itertools
from collections.abc import Mapping

import numpy as np

from relform_controller.ocp.layout import ordered_pairs
from relform_controller.reference.trajectory import smooth_step
from relform_core.arrays import Array, Integers
from relform_core.errors import ConfigError
from relform_core.scenario_config import ScenarioConfig
from relform_core.schema import Vector3


class FormationSchedule:
    """The formation of each phase, or the one that was set by hand since.

    A reference is the position of every target in {mc} of its observer, for equal yaws: shape (pair, 3) [m].
    """

    def __init__(self, config: ScenarioConfig) -> None:
        self._team = config.team
        self._pairs = ordered_pairs(len(self._team.vehicles))
        self._config = config
        self._period = config.controller.period
        self._period_ns = config.period_ns
        self._ramp = config.controller.formation_ramp
        self._by_stamp = _formation_starts(config)
        self.by_follower: Mapping[str, Vector3] = config.formations[config.phases[0].formation]
        """The present formation: position of each follower relative to the leader [m]."""
        self._target = self._pair_positions(self.by_follower)
        self._previous = self._target
        self._changed_ns = 0
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

    def advance(self, stamp_ns: int) -> None:
        """Apply what the scenario or a request changes at the control step of this instant [ns]."""
        formation = self._by_stamp.get(stamp_ns) if self._requested is None else self._requested
        self._requested = None
        if formation is not None:
            self._previous = self.reference(np.array([stamp_ns]))[:, 0]
            self.by_follower = formation
            self._target = self._pair_positions(formation)
            self._changed_ns = stamp_ns

    @property
    def target(self) -> Array:
        """The present formation without its ramp, shape (pair, 3)."""
        return self._target

    def reference(self, stamps_ns: Integers) -> Array:
        """What to track at these instants [ns], a new formation blended in; shape (pair, instant, 3)."""
        since_change = (stamps_ns - self._changed_ns) / self._period_ns * self._period
        share = smooth_step(since_change, self._ramp)[:, None]
        return self._previous[:, None] + (self._target - self._previous)[:, None] * share

    def _pair_positions(self, formation: Mapping[str, Vector3]) -> Array:
        by_vehicle = {self._team.leader: (0.0, 0.0, 0.0), **formation}
        places = np.array([by_vehicle[name] for name in self._team.vehicles])
        return np.array([places[j] - places[i] for i, j in self._pairs])


def _formation_starts(config: ScenarioConfig) -> dict[int, Mapping[str, Vector3]]:
    """The formation of each phase that changes it, by the instant at which the phase starts [ns]."""
    return {
        step * config.period_ns: config.formations[phase.formation]
        for step, (before, phase) in zip(
            config.phase_starts[1:], itertools.pairwise(config.phases), strict=True
        )
        if phase.formation != before.formation
    }
