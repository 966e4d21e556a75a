"""The formation reference: the present formation, with a new one blended in."""

from collections.abc import Mapping
from typing import overload

import numpy as np

from relform_controller.ocp.layout import ordered_pairs
from relform_core.arrays import Array, Integers
from relform_core.blend import Blend
from relform_core.errors import ConfigError
from relform_core.formation_change import FormationChanges
from relform_core.phases_config import PhaseConfig
from relform_core.scenario_config import ScenarioConfig
from relform_core.schema import Vector3


class FormationSchedule:
    """The formation of each phase, or of the last request since the phase changed it.

    A reference is the position of every target in {mc} of its observer, for equal yaws: shape (pair, 3) [m].
    """

    def __init__(self, config: ScenarioConfig) -> None:
        self._config = config
        self._pairs = ordered_pairs(len(config.team.vehicles))
        self._changes = FormationChanges(config)
        self.by_follower: Mapping[str, Vector3] = config.formations[config.phases[0].formation]
        """The present formation: position of each follower relative to the leader [m]."""
        self._places = self._changes.at_rest(self.by_follower)
        """Of all vehicles, in {mc} of the leader."""
        target = self._of_pairs(self._places.target)
        self._reference = Blend(target, np.zeros_like(target), target, 0.0)
        self._changed_ns = 0
        self.next_ns = 0
        """Instant of the next control step, from which a request holds."""
        self._requested: Mapping[str, Vector3] | None = None

    def request(self, formation: Mapping[str, Vector3]) -> None:
        """Fly another formation from the next step on, until the scenario changes it.

        Args:
            formation: position of each follower relative to the leader [m]; ``check`` has accepted it.
        """
        self._requested = dict(formation)

    def check(self, formation: Mapping[str, Vector3]) -> None:
        """Check a request.

        Args:
            formation: position of each follower relative to the leader [m].
        Raises:
            ConfigError: the team cannot fly it, or cannot get there; the message gives the reason.
        """
        if problem := self._config.formation_problem(formation):
            raise ConfigError(f"formation {problem}")
        change = self._changes.begin(self._places, self._since_change(self.next_ns), formation)
        too_close = self._changes.problem(change, self.next_ns // self._config.period_ns)
        if too_close is not None:
            if too_close.phase is None:
                raise ConfigError(f"no way to this formation: {too_close}; change it in two steps")
            name = too_close.phase.name
            raise ConfigError(
                f"no way from this formation to that of phase '{name}', which comes next: {too_close}"
            )

    def advance(self, stamp_ns: int) -> None:
        """Apply what the scenario or a request changes at the control step of this instant [ns]."""
        phase = self._changes.by_step.get(stamp_ns // self._config.period_ns)
        if self._requested is not None:
            self._begin(stamp_ns, self._requested, None)
        elif phase is not None:
            self._begin(stamp_ns, self._config.formations[phase.formation], phase)
        self._requested = None
        self.next_ns = stamp_ns + self._config.period_ns

    @property
    def kept_until_ns(self) -> int:
        """Instant at which the scenario next changes the formation, or ends."""
        period_ns = self._config.period_ns
        changes_ns = [step * period_ns for step in self._changes.by_step if step * period_ns > self.next_ns]
        return min(changes_ns, default=self._config.n_steps * period_ns)

    @property
    def target(self) -> Array:
        """The present formation without its ramp, shape (pair, 3)."""
        return self._reference.target

    def reference(self, stamps_ns: Integers) -> Array:
        """What to track at these instants [ns], a new formation blended in; shape (pair, instant, 3)."""
        return self._reference.at(self._since_change(stamps_ns))

    def _begin(self, stamp_ns: int, formation: Mapping[str, Vector3], phase: PhaseConfig | None) -> None:
        start = self.reference(np.array([stamp_ns]))[:, 0]
        self._places = self._changes.begin(self._places, self._since_change(stamp_ns), formation, phase)
        self._reference = Blend(
            start,
            self._of_pairs(self._places.velocity),
            self._of_pairs(self._places.target),
            self._places.duration,
        )
        self._changed_ns = stamp_ns
        self.by_follower = formation

    @overload
    def _since_change(self, stamps_ns: int) -> float: ...
    @overload
    def _since_change(self, stamps_ns: Integers) -> Array: ...
    def _since_change(self, stamps_ns: int | Integers) -> float | Array:
        """Time since the present change began [s]."""
        return (stamps_ns - self._changed_ns) / self._config.period_ns * self._config.controller.period

    def _of_pairs(self, by_vehicle: Array) -> Array:
        """Target minus observer, shape (pair, 3)."""
        return np.array([by_vehicle[j] - by_vehicle[i] for i, j in self._pairs])
