"""Lock-step as one node sees it: the step of each message, and whether a step's messages have arrived.

Step k is the instant k * period. A message belongs to the step in which its sender announces it.
"""

from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Generic, TypeVar

from relform_msgs.msg import StepDone
from relform_ros.rejection import Reason, RejectionError

JOINED: int = StepDone.JOINED
"""Step number of a node that has started and waits for the others."""
READY: int = StepDone.READY
"""Step number of a node that has found the others: the flight may start."""

AHEAD = 2
"""How far a message may be ahead of the oldest open step: a node closes step k - 1 during step k, and others
may have received the tick of step k + 1 and send for that step before this node receives the tick."""

M = TypeVar("M")
T = TypeVar("T")


@dataclass(frozen=True)
class Done:
    """A member has finished a step (relform_msgs/StepDone)."""

    node: str
    step: int
    sent: tuple[tuple[str, int], ...]
    """Topic and stamp [ns] of each message that it has published in this step."""
    fault: str
    """Empty, or why the node cannot continue."""
    configuration: str = ""
    """What must be equal on all nodes; set when a node joins."""
    process: int = 0
    """A number that no other process of this name has, set when a node joins; 0 in lock-step."""
    rests: bool = False
    """Whether the node is a vehicle on the ground with its motors off or idle."""


def step_at(stamp_ns: int, period_ns: int) -> int:
    """Number of the step at an instant.

    Raises:
        RejectionError: no step begins at this instant.
    """
    step, remainder = divmod(stamp_ns, period_ns)
    if remainder:
        raise RejectionError(
            Reason.INVALID, f"stamp {stamp_ns} ns is no multiple of the period {period_ns} ns"
        )
    return step


class _OpenSteps(Generic[T]):
    """What is known of each step for which messages are accepted, and of the step before them."""

    def __init__(self, empty: Callable[[], T]) -> None:
        self._oldest = 0
        self._steps: defaultdict[int, T] = defaultdict(empty)

    def __getitem__(self, step: int) -> T:
        return self._steps[step]

    def __len__(self) -> int:
        return len(self._steps)

    def opened(self, step: int) -> T:
        """The step of a message.

        Raises:
            RejectionError: the step is over, or no node can have reached it.
        """
        if step < self._oldest:
            raise RejectionError(Reason.STALE, f"belongs to step {step}, which is over (now: {self._oldest})")
        if step > self._oldest + AHEAD:
            raise RejectionError(
                Reason.EARLY, f"belongs to step {step}, which is to come (now: {self._oldest})"
            )
        return self._steps[step]

    def close(self, step: int) -> None:
        """Accept no more messages for a step and all before it; forget what is older than this step."""
        self._oldest = max(self._oldest, step + 1)
        for old in [each for each in self._steps if each < step]:
            del self._steps[old]


class Announcements:
    """What the awaited members of the barrier report to have sent, step by step."""

    def __init__(self, awaited: Iterable[str]) -> None:
        self._awaited = frozenset(awaited)
        self._steps: _OpenSteps[dict[str, Done]] = _OpenSteps(dict)

    def add(self, done: Done) -> None:
        """Take in that a member has finished a step; that it has joined or is ready is ignored.

        Raises:
            RejectionError: it is not awaited, or has reported this step before, or the step is not open.
        """
        if done.node not in self._awaited:
            raise RejectionError(Reason.FOREIGN, f"'{done.node}' is not awaited here")
        if done.step < 0:
            return
        step = self._steps.opened(done.step)
        if done.node in step:
            raise RejectionError(Reason.DUPLICATE, f"{done.node} has finished step {done.step} before")
        step[done.node] = done

    def complete(self, step: int) -> bool:
        """Whether all awaited members have finished a step."""
        return len(self._steps[step]) == len(self._awaited)

    def sent(self, step: int) -> Counter[tuple[str, int]]:
        """Number of messages of a step by topic and stamp [ns], of the members that have finished it."""
        return Counter(message for done in self._steps[step].values() for message in done.sent)

    def faulty(self, step: int) -> bool:
        """Whether an awaited member has reported that it cannot continue."""
        return any(done.fault for done in self._steps[step].values())

    def close(self, step: int) -> None:
        """Close a step and all before it."""
        self._steps.close(step)


class StepInbox(Generic[M]):
    """Messages of one topic, from their arrival until the step in which they are due.

    A message is due in the step in which its sender announces it, which may be later than its stamp.

    Args:
        reject: called with the reason for each message that no sender has announced.
        lead: how many steps before its stamp a message may be due.
    """

    def __init__(self, period_ns: int, reject: Callable[[RejectionError], None], lead: int = 0) -> None:
        self._period_ns = period_ns
        self._reject = reject
        self._lead = lead
        self._oldest = 0
        self._messages: defaultdict[int, list[_Arrived[M]]] = defaultdict(list)
        """By stamp [ns]."""

    def __len__(self) -> int:
        return sum(map(len, self._messages.values()))

    def add(self, stamp_ns: int, message: M) -> None:
        """Keep a message that has arrived.

        Raises:
            RejectionError: no step begins at its stamp, or no node can have reached that step.
        """
        step = step_at(stamp_ns, self._period_ns)
        if step > self._oldest + AHEAD + self._lead:
            raise RejectionError(
                Reason.EARLY, f"belongs to step {step}, which is to come (now: {self._oldest})"
            )
        self._messages[stamp_ns].append(_Arrived(message, self._oldest + AHEAD))

    def has(self, due: Mapping[int, int]) -> bool:
        """Whether so many messages of these stamps [ns] have arrived."""
        return all(len(self._messages.get(stamp_ns, ())) >= number for stamp_ns, number in due.items())

    def take(self, step: int, due: Mapping[int, int]) -> list[M]:
        """The messages that are due in a step, by stamp; the step is closed.

        Args:
            due: how many messages of which stamp [ns]; see ``has``.
        """
        taken = []
        for stamp_ns, number in sorted(due.items()):
            arrived = self._messages.pop(stamp_ns)
            taken += [each.message for each in arrived[:number]]
            for _ in arrived[number:]:
                self._reject(RejectionError(Reason.DUPLICATE, f"stamp {stamp_ns} ns has a message already"))
        self._oldest = max(self._oldest, step + 1)
        for stamp_ns, arrived in list(self._messages.items()):
            kept = [each for each in arrived if each.kept_until > step]
            for _ in arrived[len(kept) :]:
                self._reject(RejectionError(Reason.STALE, f"stamp {stamp_ns} ns is due in no step"))
            if kept:
                self._messages[stamp_ns] = kept
            else:
                del self._messages[stamp_ns]
        return taken


@dataclass(frozen=True)
class _Arrived(Generic[M]):
    message: M
    kept_until: int
    """The last step in which it can be due."""
