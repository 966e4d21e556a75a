"""Which process is which node of a flight: the clock's decisions on processes that want to join."""

from collections import Counter
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass
from enum import IntEnum

from relform_ros.lockstep import READY, Done
from relform_ros.rejection import Reason, RejectionError

SILENCE_S = 0.5
"""For so long a node must be silent before another process may take its place [s]."""


class Verdict(IntEnum):
    """The numbers of MemberChange.msg."""

    ADMITTED = 0
    """The process takes the place of the one that was this node before."""
    REFUSED = 1
    """The process takes no part."""


@dataclass(frozen=True)
class MemberChange:
    """A decision on one process (relform_msgs/MemberChange)."""

    step: int
    verdict: Verdict
    node: str
    process: int
    """See ``Done.process``."""
    reason: str
    """For people."""


class Membership:
    """The processes of a flight.

    Before the start the newest process of a name is the node. In flight another one takes its place if it may
    be replaced and has been silent for a while; else the other one is refused, and the flight goes on.

    Args:
        members: fully qualified names of the nodes.
        replaceable: those among them that may be started again in flight.
        configuration: what every process must report when it joins.
        now: steady time [s].
    """

    def __init__(
        self,
        members: Iterable[str],
        replaceable: Collection[str],
        configuration: str,
        now: Callable[[], float],
    ) -> None:
        self._processes = dict.fromkeys(members, 0)
        """The number of the process that is each node; 0: none has joined."""
        self._heard = dict.fromkeys(self._processes, now())
        """When each node has last finished a step."""
        self._replaceable = replaceable
        self._configuration = configuration
        self._now = now
        self._waiting: dict[str, Done] = {}
        """The newest process that wants to take the place of a node, by the name of the node."""
        self._changes: list[MemberChange] = []
        self._counts: Counter[Verdict] = Counter()

    def join(self, done: Done, step: int) -> bool:
        """Take in that a process has joined.

        Args:
            done: its report.
            step: the present step; READY before the first.
        Returns:
            Whether it is another process than before, and is the node from now on.
        Raises:
            RejectionError: the flight runs.
        """
        before = self._processes[done.node]
        if step == READY:
            self._processes[done.node] = done.process
            return before not in (0, done.process)
        if (waiting := self._waiting.get(done.node)) is not None and waiting.process != done.process:
            self._decide(Verdict.REFUSED, done, step, f"another process waits to become {done.node}")
        elif done.process != before or before == 0:
            if done.node not in self._replaceable:
                self._decide(Verdict.REFUSED, done, step, "the flight runs, and goes on without this process")
            elif done.configuration != self._configuration:
                self._decide(Verdict.REFUSED, done, step, "the flight has another configuration")
            else:
                self._waiting[done.node] = done
        raise RejectionError(Reason.STALE, f"{done.node} joins in step {step}")

    def heard(self, node: str, step: int) -> None:
        """Take in that a node has finished a step: whoever wants to take its place may not."""
        self._heard[node] = self._now()
        if (waiting := self._waiting.pop(node, None)) is not None:
            self._decide(Verdict.REFUSED, waiting, step, f"another process is {node} and takes part")

    def admit(self, step: int) -> list[str]:
        """Let those take the place of silent nodes who want to; returns the names of these nodes."""
        admitted = [node for node in self._waiting if self._now() - self._heard[node] > SILENCE_S]
        for node in admitted:
            done = self._waiting.pop(node)
            silent = self._now() - self._heard[node]
            self._processes[node], self._heard[node] = done.process, self._now()
            self._decide(Verdict.ADMITTED, done, step, f"nothing was heard from {node} for {silent:.1f} s")
        return admitted

    def take_changes(self) -> list[MemberChange]:
        """The decisions since the last call."""
        changes, self._changes = self._changes, []
        return changes

    def report(self) -> Mapping[str, object]:
        """What the clock adds to its diagnostics."""
        return {f"members.{verdict.name.lower()}": self._counts[verdict] for verdict in Verdict}

    def _decide(self, verdict: Verdict, done: Done, step: int, reason: str) -> None:
        self._counts[verdict] += 1
        self._changes.append(MemberChange(step, verdict, done.node, done.process, reason))
