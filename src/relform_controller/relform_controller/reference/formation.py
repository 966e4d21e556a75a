"""The formation reference: the present formation, with a new one blended in.

A team that starts elsewhere first holds its place; then it forms up, which is a change of formation, too.
"""

from collections.abc import Mapping
from typing import overload

import numpy as np

from relform_controller.ocp.layout import ordered_pairs
from relform_controller.reference.form_up import StartPoses, YawRamp, seen_by_turned
from relform_core.arrays import Array, Integers
from relform_core.blend import Blend
from relform_core.errors import ConfigError, FlightError
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
        self._observers, self._targets = np.array(ordered_pairs(len(config.team.vehicles))).T
        self._changes = FormationChanges(config)
        self.by_follower: Mapping[str, Vector3] = config.formations[config.phases[0].formation]
        """The present formation: position of each follower relative to the leader [m]."""
        self._places = self._changes.at_rest(self.by_follower)
        """Of all vehicles, in {mc} of the leader."""
        self.target = self._of_pairs(self._places.target)
        """The present formation without its ramp, shape (pair, 3)."""
        self._reference = Blend.at_rest(self.target)
        self._changed_ns = 0
        self.next_ns = 0
        """Instant of the next control step, from which a request holds."""
        self._requested: tuple[Mapping[str, Vector3], PhaseConfig | None] | None = None
        self._held: StartPoses | None = None
        """Where the team stays; None: it has started."""
        self._yaws: YawRamp | None = None
        """Of all vehicles relative to the leader; None: the team started with equal yaws."""
        self._formed_up_ns = 0
        """Instant at which the team began to form up."""

    def hold(self, poses: StartPoses) -> None:
        """Stay at these poses until the first control step, from which the team forms up."""
        self._held = poses
        self._places = Blend.at_rest(poses.places)
        self._reference = Blend.at_rest(self._of_pairs(poses.places))
        self._yaws = YawRamp.at_rest(poses.yaws)

    def request(self, formation: Mapping[str, Vector3], phase: PhaseConfig | None = None) -> None:
        """Fly another formation from the next step on, until the scenario changes it.

        Args:
            formation: position of each follower relative to the leader [m]; ``check`` has accepted it.
            phase: the phase that asks for it, if one does.
        """
        self._requested = dict(formation), phase

    def ignore_phases(self) -> None:
        """From now on only requests change the formation."""
        self._changes.by_step = {}

    def from_next_step_on(self) -> tuple[Mapping[str, Vector3], Mapping[str, Vector3]]:
        """The formation that the team is asked to have in the next step, and the last one asked for [m]."""
        places = self._places.at(np.array([self._since_change(self.next_ns)]))[:, 0].tolist()
        now: dict[str, Vector3] = {
            name: (x, y, z)
            for name, (x, y, z) in zip(self._config.team.vehicles, places, strict=True)
            if name != self._config.team.leader
        }
        return now, self.by_follower if self._requested is None else self._requested[0]

    def is_changing(self, stamp_ns: int) -> bool:
        """Whether the team still forms up, or changes its formation, at an instant [ns]."""
        turns = self._yaws is not None and not self._yaws.is_over(self._since_change(stamp_ns))
        return turns or self._since_change(stamp_ns) < self._reference.duration

    def check(self, formation: Mapping[str, Vector3]) -> None:
        """Check a request.

        Args:
            formation: position of each follower relative to the leader [m].
        Raises:
            ConfigError: the team cannot fly it, or cannot get there; the message gives the reason.
        """
        if problem := self._config.formation_problem(formation):
            raise ConfigError(f"formation {problem}")
        too_close = self._changes.problem(self.way_to(formation), self.next_ns // self._config.period_ns)
        if too_close is not None:
            if too_close.phase is None:
                raise ConfigError(f"no way to this formation: {too_close}; change it in two steps")
            name = too_close.phase.name
            raise ConfigError(
                f"no way from this formation to that of phase '{name}', which comes next: {too_close}"
            )

    def way_to(self, formation: Mapping[str, Vector3]) -> Blend:
        """The way of all vehicles to a formation from the next step on, in {mc} of the leader."""
        return self._changes.begin(self._places, self._since_change(self.next_ns), formation)

    def advance(self, stamp_ns: int) -> None:
        """Apply what the scenario or a request changes at the control step of this instant [ns].

        Raises:
            FlightError: the team held its place, and cannot get from there into formation.
        """
        phase = self._changes.by_step.get(stamp_ns // self._config.period_ns)
        if self._held is not None:
            asked = self.by_follower if self._requested is None else self._requested[0]
            self._form_up(stamp_ns, self._held, asked)
        elif self._requested is not None:
            # Vehicles that fly around each other on the way to it continue: no other way was checked.
            if self._requested[0] != self.by_follower or self._places.detours is None:
                self._begin(stamp_ns, *self._requested)
        elif phase is not None:
            self._begin(stamp_ns, self._config.formations[phase.formation], phase)
        self._held = self._requested = None
        self.next_ns = stamp_ns + self._config.period_ns

    @property
    def kept_until_ns(self) -> int:
        """Instant at which the scenario next changes the formation, or ends."""
        period_ns = self._config.period_ns
        changes_ns = [step * period_ns for step in self._changes.by_step if step * period_ns > self.next_ns]
        return min(changes_ns, default=self._config.n_steps * period_ns)

    def reference(self, stamps_ns: Integers) -> Array:
        """What to track at these instants [ns], a new formation blended in; shape (pair, instant, 3)."""
        p_B1B2_C0 = self._reference.at(self._since_change(stamps_ns))
        periods = (stamps_ns - self._formed_up_ns) / self._config.period_ns
        since_start = periods * self._config.controller.period
        if self._yaws is None or self._yaws.is_over(since_start.min()):
            return p_B1B2_C0
        return seen_by_turned(p_B1B2_C0, self._yaws.at(since_start)[self._observers])

    def _form_up(self, stamp_ns: int, poses: StartPoses, formation: Mapping[str, Vector3]) -> None:
        self._begin(stamp_ns, formation, None)
        self._yaws, self._formed_up_ns = YawRamp.to_zero(poses.yaws), stamp_ns
        if problem := self._changes.problem(self._places, stamp_ns // self._config.period_ns):
            raise FlightError(f"the team cannot form up from where it is: {problem}")

    def _begin(self, stamp_ns: int, formation: Mapping[str, Vector3], phase: PhaseConfig | None) -> None:
        start = self._reference.at(self._since_change(np.array([stamp_ns])))[:, 0]
        self._places = self._changes.begin(self._places, self._since_change(stamp_ns), formation, phase)
        self._reference = Blend(
            start,
            self._of_pairs(self._places.velocity),
            self._of_pairs(self._places.target),
            self._places.duration,
            None if self._places.detours is None else self._of_pairs(self._places.detours),
        )
        self._changed_ns = stamp_ns
        self.by_follower = formation
        self.target = self._reference.target

    @overload
    def _since_change(self, stamps_ns: int) -> float: ...
    @overload
    def _since_change(self, stamps_ns: Integers) -> Array: ...
    def _since_change(self, stamps_ns: int | Integers) -> float | Array:
        """Time since the present change began [s]."""
        return (stamps_ns - self._changed_ns) / self._config.period_ns * self._config.controller.period

    def _of_pairs(self, by_vehicle: Array) -> Array:
        """Target minus observer, shape (pair, ...)."""
        relative: Array = by_vehicle[self._targets] - by_vehicle[self._observers]
        return relative
