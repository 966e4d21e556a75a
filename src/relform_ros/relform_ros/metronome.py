"""The beat of a flight in real time: step k begins k periods after the first, if the world keeps pace."""

from collections import Counter
from collections.abc import Iterable, Mapping
from typing import Any

from relform_ros.barrier import Barrier, SilentNodeError
from relform_ros.lockstep import READY, Done


class Metronome(Barrier):
    """A barrier that waits for its members only before the first step, after the last, and after a fault.

    In between a member may finish steps late, or leave some out. Each step that it had not finished when the
    next one began is counted; of an observer, when the one after that began.

    The simulated vehicles are the world, which must not fall behind the time of the flight: if one of them is
    late by more than a step, the next step is held back, and all that follow. The flight then takes longer.
    A vehicle that finishes nothing for the step timeout ends the flight.

    Controllers and observers may be lost, and started again. A flight without a controller goes on as long as
    a vehicle is in the air: vehicles without commands land by themselves.

    Args:
        args: of ``Barrier``.
        world: names of the members that are the world.
        controllers: names of the members that command it.
        options: of ``Barrier``.
    """

    def __init__(self, *args: Any, world: Iterable[str], controllers: Iterable[str], **options: Any) -> None:
        super().__init__(*args, **options)
        self._world = tuple(world)
        self._controllers = tuple(controllers)
        self._start = self._began
        """Of step 0, steady time, plus the time for which steps were held back [s]."""
        self._holds = False
        """Whether the next step is held back."""
        self._held = 0.0
        """Time for which steps were held back [s]."""
        self._active = dict.fromkeys(self._finished, self._began)
        """When each member has last finished a step, or had nothing to do [s]."""
        self._resting: set[str] = set()
        """The vehicles that are on the ground with their motors off or idle."""
        self._missed: Counter[str] = Counter()
        """Number of steps that a member finished late or not at all."""

    def add(self, done: Done) -> None:
        """See ``Barrier``; a member may leave out steps."""
        super().add(done)
        if done.step > READY:
            self._active[done.node] = self._now()
            (self._resting.add if done.rests else self._resting.discard)(done.node)

    def _may_follow(self, step: int, expected: int) -> bool:
        return step >= expected

    def due(self) -> float:
        """See ``Barrier``."""
        return self._start + (self._step + 1) * self._period

    def complete(self) -> bool:
        """See ``Barrier``: whether the next step may begin.

        Raises:
            SilentNodeError: a vehicle finished nothing in time; or no controller did, and all vehicles are on
                the ground.
        """
        for node in self._membership.admit(self._step):
            self._finished[node], self._active[node] = self._step - 1, self._now()
        silent = self._silent_nodes()
        if self._step == self._n_steps and silent and silent == self._late():
            raise self._silent(silent)  # they were lost before, so there is nothing to wait for
        if self._step in (READY, self._n_steps) or self._faults:
            return super().complete()
        if lost := [node for node in silent if node in self._world]:
            raise self._silent(lost)
        if self._resting.issuperset(self._world) and set(self._controllers).issubset(silent):
            _, limit = self._timeouts
            what = f"{self._when(self._step)}: all vehicles are on the ground, and nothing was heard for"
            raise SilentNodeError(f"{what} {limit:g} s (lockstep.step_timeout_s) from", self._controllers)
        if self._now() < self.due():
            return False
        keeps_pace = all(self._finished[node] >= self._step - 1 for node in self._world)
        self._holds |= not keeps_pace
        return keeps_pace

    def advance(self) -> int:
        """See ``Barrier``."""
        late = self._late()
        if self._step == READY:
            self._start = self._now()
        else:
            self._missed.update(late)
        if self._holds:
            delay = self._now() - self.due()
            self._start += delay
            self._held += delay
            self._holds = False
        for node in self._active.keys() - set(late):
            self._active[node] = self._now()
        return super().advance()

    def report(self) -> Mapping[str, object]:
        """See ``Barrier``."""
        missed = {f"real_time.missed_steps.{node}": self._missed[node] for node in self._finished}
        return {**super().report(), **missed, "real_time.held_s": self._held}

    def _silent_nodes(self) -> list[str]:
        """The members that have finished nothing for the step timeout, though there was something to do."""
        now, (_, limit) = self._now(), self._timeouts
        return [node for node in self._late() if now - self._active[node] > limit]
