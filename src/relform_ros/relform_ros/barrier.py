"""The lock-step barrier: the next step begins when all members have finished this one."""

import math
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence

from relform_core.errors import FlightError
from relform_ros.lockstep import JOINED, READY, Done
from relform_ros.membership import MemberChange, Membership
from relform_ros.rejection import Reason, RejectionError


class SilentNodeError(FlightError):
    """Members did not finish a step in time."""

    def __init__(self, what: str, nodes: Sequence[str]) -> None:
        super().__init__(f"{what}: {', '.join(nodes)}")
        self.what = what
        self.nodes = nodes


class VehicleFaultError(FlightError):
    """A member reported that it cannot continue."""


class DisagreementError(FlightError):
    """A member flies another configuration."""


class Barrier:
    """Which members have finished the current step.

    No other member waits for the observers, so they may be one step behind: they delay a flight only if they
    cannot keep pace. Before the start, at the end and after a fault the barrier waits for them as for others.

    Args:
        members: fully qualified names of all nodes but the clock.
        observers: those among the members that may be one step behind.
        configuration: what every member must report when it joins.
        n_steps: the last step.
        period: length of a step [s], for messages.
        start_timeout: time that all members may take to be ready [s].
        step_timeout: time that all members may take for a step [s].
        now: steady time [s].
        replaceable: the members that may be started again in flight.
    """

    def __init__(
        self,
        members: Iterable[str],
        observers: Iterable[str],
        configuration: str,
        n_steps: int,
        period: float,
        start_timeout: float,
        step_timeout: float,
        now: Callable[[], float],
        replaceable: Collection[str] = (),
    ) -> None:
        self._observers = tuple(observers)
        self._finished = dict.fromkeys(members, READY - 1)
        """The newest step that each member has finished."""
        self._membership = Membership(self._finished, replaceable, configuration, now)
        self._faults: dict[str, str] = {}
        """Why members cannot continue, by name."""
        self._configuration = configuration
        self._disagreement = ""
        """Which member flies another configuration, in words; empty: none."""
        self._n_steps = n_steps
        self._period = period
        self._timeouts = start_timeout, step_timeout
        self._now = now
        self._step = READY
        self._began = now()

    @property
    def step(self) -> int:
        """The current step; READY before the first."""
        return self._step

    def add(self, done: Done) -> None:
        """Take in that a member has finished a step.

        Raises:
            RejectionError: the node is no member, or this is not the step that it has to finish next.
        """
        if done.node not in self._finished:
            raise RejectionError(Reason.FOREIGN, f"'{done.node}' is no member of this barrier")
        if done.step == JOINED:
            if self._membership.join(done, self._step):
                self._finished[done.node] = READY - 1  # of the process before
            if done.configuration != self._configuration:
                self._disagreement = (
                    f"{done.node} flies another configuration ({done.configuration} instead of "
                    f"{self._configuration}): start all nodes with the same scenario file and observers"
                )
            return
        expected = self._finished[done.node] + 1
        if done.step == expected - 1:
            raise RejectionError(Reason.DUPLICATE, f"{done.node} has finished step {done.step} before")
        if done.step > self._step or not self._may_follow(done.step, expected):
            reason = Reason.STALE if done.step < expected else Reason.EARLY
            raise RejectionError(reason, f"{done.node} is in step {done.step}, now is {self._step}")
        self._finished[done.node] = done.step
        if done.step > READY:
            self._membership.heard(done.node, self._step)
        if done.fault:
            self._faults[done.node] = f"{done.node} in {self._when(done.step)}: {done.fault}"

    def _may_follow(self, step: int, expected: int) -> bool:
        """Whether a member that is expected to finish a step may finish another one."""
        return step == expected

    def has_finished(self, member: str) -> bool:
        """Whether a member has finished the last step of the flight, and may leave."""
        return self._finished[member] == self._n_steps

    def due(self) -> float:
        """Steady time before which the next step does not begin [s]."""
        return -math.inf

    def take_changes(self) -> list[MemberChange]:
        """The decisions since the last call on processes that want to join."""
        return self._membership.take_changes()

    def report(self) -> Mapping[str, object]:
        """What the clock adds to its diagnostics."""
        return self._membership.report()

    def complete(self) -> bool:
        """Whether the next step may begin.

        Raises:
            DisagreementError: a member flies another configuration.
            SilentNodeError: not yet, and the time for this step is over.
            VehicleFaultError: likewise, and a member has reported a fault.
        """
        if self._disagreement:
            raise DisagreementError(self._disagreement)
        if not (late := self._late()):
            return True
        timeout = self._timeouts[self._step != READY]
        if self._now() - self._began <= timeout:
            return False
        self._check_faults()
        raise self._silent(late)

    def _silent(self, nodes: Sequence[str]) -> SilentNodeError:
        """The error that names the members that did not finish in time."""
        start_timeout, step_timeout = self._timeouts
        if self._step == READY:
            return SilentNodeError(f"not ready within {start_timeout:g} s", nodes)
        limit = f"{step_timeout:g} s (lockstep.step_timeout_s)"
        return SilentNodeError(f"{self._when(self._step)} not finished within {limit}", nodes)

    def advance(self) -> int:
        """Begin the next step, and return it; after the last one it is ``n_steps + 1``.

        Raises:
            VehicleFaultError: a member has reported a fault.
        """
        self._check_faults()
        self._step += 1
        self._began = self._now()
        return self._step

    def _late(self) -> list[str]:
        lag = 0 if self._step in (READY, self._n_steps) or self._faults else 1
        return [
            member
            for member, finished in self._finished.items()
            if finished < self._step - (lag if member in self._observers else 0)
            and member not in self._faults
        ]

    def _check_faults(self) -> None:
        for fault in self._faults.values():
            raise VehicleFaultError(fault)

    def _when(self, step: int) -> str:
        return f"step {step} ({step * self._period:.2f} s)"
