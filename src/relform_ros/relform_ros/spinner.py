"""How the nodes of one process wait: meanwhile callbacks run, and other nodes continue."""

import inspect
import math
import time
import types
from collections.abc import Callable, Coroutine, Generator, Iterable
from dataclasses import dataclass
from types import FrameType
from typing import Any

from rclpy.experimental.events_executor import EventsExecutor
from rclpy.node import Node
from rclpy.subscription import Subscription

from relform_ros.clock_jumps import woken_after_jumps
from relform_ros.intra_process import IntraProcess

SIGNAL_LATENCY_S = 0.1
"""Longest time until a waiting node notices a signal."""

LOOK_EVERY_S = 0.01
"""How often callbacks run while the nodes of a process keep each other busy."""

SILENCE = 0.5
"""Share of the waiting time without a message after which missed messages are looked for."""


class StopRequestedError(Exception):
    """SIGINT or SIGTERM arrived."""


@dataclass(frozen=True, eq=False)
class Wait:
    """One logic waits, and has to be asked again after some time."""

    poll_s: float
    """At the latest after this time [s]."""
    deadline: float = math.inf
    """At the latest at this instant of ``time.monotonic`` [s]."""

    @property
    def left_s(self) -> float:
        """Time until then [s]."""
        return max(0.0, min(self.poll_s, self.deadline - time.monotonic()))


Logic = Coroutine[Wait, None, None]
"""What a node does; it waits by ``until``, and meanwhile other nodes of its process continue."""


@types.coroutine
def until(
    condition: Callable[[], bool], poll_s: float = SIGNAL_LATENCY_S, deadline: float = math.inf
) -> Generator[Wait, None, None]:
    """Wait until a condition holds.

    Args:
        condition: asked after each callback; an error that it raises ends the waiting.
        poll_s: how often it is asked if nothing happens.
        deadline: instant of ``time.monotonic`` at which it is asked in any case [s].
    """
    if condition():
        return
    wait = Wait(poll_s, deadline)
    yield wait
    while not condition():
        yield wait


async def until_instant(deadline: float) -> None:
    """Wait until an instant of ``time.monotonic`` [s]."""
    await until(lambda: time.monotonic() >= deadline, deadline=deadline)


class Spinner:
    """Lets callbacks of the nodes of one process run while their logic waits.

    ``EventsExecutor`` is the fastest executor, but its ``spin()`` ignores signals in the wheels of Jazzy;
    ``spin_once`` in a loop is as fast. It also misses a message that arrives while it registers for those of
    a topic, because rmw_fastrtps first counts the messages and then listens. So when no message comes for a
    while, the spinner takes missed messages from the subscriptions.
    """

    def __init__(self, *nodes: Node, watch: Callable[[], None] | None = None) -> None:
        """Spin for some nodes of one context.

        Args:
            watch: called in every turn; what it raises ends the waiting.
        """
        self.intra_process = IntraProcess(node.get_fully_qualified_name() for node in nodes)
        """What these nodes send each other."""
        self._nodes = nodes
        self._executor = EventsExecutor(context=nodes[0].context)
        for node in nodes:
            self._executor.add_node(node)
        self._watch = watch
        self._interrupted = False

    def interrupt(self, signum: int = 0, frame: FrameType | None = None) -> None:
        """Signal handler: end the waiting with ``StopRequestedError``."""
        self._interrupted = True

    def run(self, logics: Iterable[Logic]) -> None:
        """Run the logic of the nodes to its end; when one waits, the next one continues.

        Raises:
            StopRequestedError: by a signal.
        """
        waits: dict[Logic, Wait | None] = dict.fromkeys(logics)
        next_look = 0.0
        try:
            with woken_after_jumps(self._wake):
                while (progress := _continue(waits)) or waits:
                    if progress and len(waits) > 1:  # another logic may have waited for what this one did
                        if time.monotonic() >= next_look:
                            self.once(0.0)
                            next_look = time.monotonic() + LOOK_EVERY_S
                    elif waits:
                        self.once(min(wait.left_s for wait in waits.values() if wait is not None))
        finally:
            for logic in waits:
                logic.close()

    def once(self, timeout_s: float = SIGNAL_LATENCY_S) -> None:
        """Run the next callback, or none if no message arrives in time.

        Raises:
            StopRequestedError: by a signal.
        """
        if self._interrupted:
            raise StopRequestedError
        if self._watch is not None:
            self._watch()
        self._spin_once(timeout_s)

    def close(self) -> None:
        """Release the nodes: until then they stay visible to others, even when they were destroyed."""
        self._executor.shutdown()

    def drain(self, duration_s: float) -> None:
        """Run callbacks for a while, even after a signal."""
        deadline = time.monotonic() + duration_s
        while (left := deadline - time.monotonic()) > 0.0:
            self._spin_once(left)

    def _wake(self) -> None:
        self._executor.wake()

    def _spin_once(self, timeout_s: float) -> None:
        began = time.monotonic()
        self._executor.spin_once(timeout_sec=timeout_s)
        if timeout_s > 0.0 and time.monotonic() - began > SILENCE * timeout_s:
            self._run_missed()

    def _run_missed(self) -> None:
        """Take all messages that have arrived, and run their callbacks."""
        for subscription in [each for node in self._nodes for each in node.subscriptions]:
            while (taken := _take(subscription)) is not None:
                # As rclpy does: the signature of a callback says whether it takes the info.
                n_arguments = len(inspect.signature(subscription.callback).parameters)
                subscription.callback(*taken[:n_arguments])


def _continue(waits: dict[Logic, Wait | None]) -> bool:
    """Ask each logic to continue, remove those that end; returns whether one did more than wait."""
    progress = False
    for logic, wait in list(waits.items()):
        try:
            waits[logic] = logic.send(None)
        except StopIteration:
            del waits[logic]
        progress |= waits.get(logic) is not wait
    return progress


def _take(subscription: Subscription) -> tuple[Any, Any] | None:
    """The next message of a subscription and its info."""
    with subscription.handle:
        taken: tuple[Any, Any] | None = subscription.handle.take_message(
            subscription.msg_type, subscription.raw
        )
    return taken
