"""The lock-step barrier: the next step begins when all members have finished this one."""

from collections.abc import Callable, Iterable, Sequence

from relform_core.errors import FlightError
from relform_ros.lockstep import READY, Done
from relform_ros.rejection import Reason, RejectionError


class SilentNodeError(FlightError):
    """Members did not finish a step in time."""

    def __init__(self, what: str, nodes: Sequence[str]) -> None:
        super().__init__(f"{what}: {', '.join(nodes)}")
        self.what = what
        self.nodes = nodes


class VehicleFaultError(FlightError):
    """A member says that the run cannot go on."""


class Barrier:
    """Who has finished the current step, and who has not.

    Args:
        members: fully qualified node names.
        period: length of a step [s], for messages.
        start_timeout: time that all members may take to be ready [s].
        step_timeout: time that all members may take for a step [s].
        now: steady time [s].
    """

    def __init__(
        self,
        members: Iterable[str],
        period: float,
        start_timeout: float,
        step_timeout: float,
        now: Callable[[], float],
    ) -> None:
        self._members = tuple(members)
        self._period = period
        self._timeouts = start_timeout, step_timeout
        self._now = now
        self._step = READY
        self._began = now()
        self._done: dict[str, Done] = {}

    @property
    def step(self) -> int:
        """The current step; READY before the first."""
        return self._step

    def add(self, done: Done) -> None:
        """Take in that a member has finished a step.

        Raises:
            RejectionError: it is no member, has finished before, or the step is not the current one.
        """
        if done.node not in self._members:
            raise RejectionError(Reason.FOREIGN, f"'{done.node}' is no member of this barrier")
        if done.step != self._step:
            reason = Reason.STALE if done.step < self._step else Reason.EARLY
            raise RejectionError(reason, f"{done.node} is in step {done.step}, now is {self._step}")
        if done.node in self._done:
            raise RejectionError(Reason.DUPLICATE, f"{done.node} has finished step {done.step} before")
        self._done[done.node] = done

    def complete(self) -> bool:
        """Whether all members have finished the current step.

        Raises:
            SilentNodeError: not all, and their time is up.
            VehicleFaultError: likewise, and another member reported a fault.
        """
        if len(self._done) == len(self._members):
            return True
        timeout = self._timeouts[self._step != READY]
        if self._now() - self._began <= timeout:
            return False
        self._check_faults()
        missing = [member for member in self._members if member not in self._done]
        if self._step == READY:
            raise SilentNodeError(f"not ready within {timeout:g} s", missing)
        limit = f"{timeout:g} s (lockstep.step_timeout_s)"
        raise SilentNodeError(f"{self._when()} not finished within {limit}", missing)

    def advance(self) -> int:
        """Begin the next step, and return it.

        Raises:
            VehicleFaultError: a member reported a fault in the step that ends.
        """
        self._check_faults()
        self._step += 1
        self._began = self._now()
        self._done = {}
        return self._step

    def _check_faults(self) -> None:
        for done in self._done.values():
            if done.fault:
                raise VehicleFaultError(f"{done.node} in {self._when()}: {done.fault}")

    def _when(self) -> str:
        return f"step {self._step} ({self._step * self._period:.2f} s)"
