"""Lock-step seen from a node: what belongs to which step, and whether all is there that was sent in it.

Step k is the instant k * period; stamps tell the step of a message. The nodes feed in what arrives.
"""

from collections import Counter, defaultdict
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass
from typing import Generic, TypeVar

from relform_ros.rejection import Reason, RejectionError

JOINED = -2
"""Step number that says: the node is there, and waits for the others."""
READY = -1
"""Step number that says: discovery is complete, the run may start."""

AHEAD = 2
"""How far a message may be ahead of the oldest open step. A node closes step k - 1 only during step k, and
may still have to hear the tick of step k + 1 when others, who have heard it, send for that step."""

M = TypeVar("M")
T = TypeVar("T")


@dataclass(frozen=True)
class Done:
    """A member has finished a step (relform_msgs/StepDone)."""

    node: str
    step: int
    sent: tuple[str, ...]
    """Topics on which it has published in this step, as often as it has."""
    fault: str
    """Empty, or why the run cannot go on."""
    configuration: str = ""
    """What must be equal on all nodes; told when a node joins."""


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
    """What is known of each step for which messages are accepted."""

    def __init__(self, empty: Callable[[], T]) -> None:
        self._oldest = 0
        self._steps: defaultdict[int, T] = defaultdict(empty)

    def __getitem__(self, step: int) -> T:
        return self._steps[step]

    def opened(self, step: int) -> T:
        """A step to which a message belongs.

        Raises:
            RejectionError: the step is over, or nobody can have reached it.
        """
        if step < self._oldest:
            raise RejectionError(Reason.STALE, f"belongs to step {step}, which is over (now: {self._oldest})")
        if step > self._oldest + AHEAD:
            raise RejectionError(
                Reason.EARLY, f"belongs to step {step}, which is to come (now: {self._oldest})"
            )
        return self._steps[step]

    def close(self, step: int) -> None:
        """Forget a step and all before it."""
        self._oldest = step + 1
        for old in [each for each in self._steps if each <= step]:
            del self._steps[old]


class Announcements:
    """What the awaited members of the barrier say they have sent, step by step."""

    def __init__(self, awaited: Iterable[str]) -> None:
        self._awaited = frozenset(awaited)
        self._steps: _OpenSteps[dict[str, Done]] = _OpenSteps(dict)

    def add(self, done: Done) -> None:
        """Take in what a member says; that it has joined or is ready is of no interest here.

        Raises:
            RejectionError: it is not awaited, or says so for the second time, or for a step that is not open.
        """
        if done.node not in self._awaited:
            raise RejectionError(Reason.FOREIGN, f"'{done.node}' is not awaited here")
        if done.step < 0:
            return
        step = self._steps.opened(done.step)
        if done.node in step:
            raise RejectionError(Reason.DUPLICATE, f"{done.node} has finished step {done.step} before")
        step[done.node] = done

    def sent(self, step: int) -> Counter[str] | None:
        """How often each topic was published in a step; None while not all awaited have finished it."""
        done = self._steps[step].values()
        if len(done) < len(self._awaited):
            return None
        return Counter(topic for each in done for topic in each.sent)

    def faulty(self, step: int) -> bool:
        """Whether an awaited member says that the run cannot go on."""
        return any(done.fault for done in self._steps[step].values())

    def close(self, step: int) -> None:
        """Forget a step and all before it."""
        self._steps.close(step)


class StepInbox(Generic[M]):
    """Messages of the open steps, at most one per topic and step."""

    def __init__(self, topics: Iterable[str], period_ns: int) -> None:
        self._topics = frozenset(topics)
        self._period_ns = period_ns
        self._steps: _OpenSteps[dict[str, M]] = _OpenSteps(dict)

    def add(self, topic: str, stamp_ns: int, message: M) -> None:
        """Put a message to its step.

        Raises:
            RejectionError: no such topic or step, or the step has this message already.
        """
        if topic not in self._topics:
            raise RejectionError(Reason.FOREIGN, "nobody here expects this topic")
        number = step_at(stamp_ns, self._period_ns)
        step = self._steps.opened(number)
        if topic in step:
            raise RejectionError(Reason.DUPLICATE, f"step {number} has this message already")
        step[topic] = message

    def at(self, step: int) -> Mapping[str, M]:
        """The messages of a step so far, by topic."""
        return self._steps[step]

    def has(self, step: int, sent: Collection[str] | None) -> bool:
        """Whether all is here that was sent in a step on topics of this inbox; None: not known yet, so no."""
        if sent is None:
            return False
        messages = self._steps[step]
        return all(topic in messages for topic in sent if topic in self._topics)

    def close(self, step: int) -> None:
        """Forget a step and all before it."""
        self._steps.close(step)


class StepTally:
    """Counts the messages of the open steps, for a node that takes any number per topic and step."""

    def __init__(self, topics: Iterable[str], period_ns: int) -> None:
        self._topics = frozenset(topics)
        self._period_ns = period_ns
        self._steps: _OpenSteps[Counter[str]] = _OpenSteps(Counter)

    def add(self, topic: str, stamp_ns: int) -> int:
        """Count a message, and tell the how many-th of its topic and step it is.

        Raises:
            RejectionError: no such step.
        """
        step = self._steps.opened(step_at(stamp_ns, self._period_ns))
        step[topic] += 1
        return step[topic]

    def has(self, step: int, sent: Mapping[str, int] | None) -> bool:
        """Whether all was counted that was sent in a step on these topics; None: not known yet, so no."""
        if sent is None:
            return False
        received = self._steps[step]
        return all(received[topic] >= number for topic, number in sent.items() if topic in self._topics)

    def close(self, step: int) -> None:
        """Forget a step and all before it."""
        self._steps.close(step)
