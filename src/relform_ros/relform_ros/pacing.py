"""How the nodes of a flight move from step to step; step k is the instant k * period.

A node reads topics, loops over ``steps``, gathers the messages of a step, publishes its own and reports
that it is done. Whether it waits for others meanwhile, and for how long, is up to the implementation.
"""

from collections.abc import AsyncIterator, Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

from relform_ros.topics import Topic


class Stamped(Protocol):
    """A message after decoding."""

    @property
    def stamp_ns(self) -> int:
        """The instant that its content is about [ns]."""


@dataclass(frozen=True)
class Gathered:
    """The messages of one step."""

    messages: Mapping[str, tuple[Any, ...]]
    """By topic in the order in which the node began to read them, oldest first; never empty.

    Decoded, or as they were serialized if the node watches the topic.
    """
    faulty: bool
    """Whether a sender of this step reported that it cannot continue."""
    arrivals_ns: Mapping[str, tuple[int, ...]] = field(default_factory=dict)
    """Instants of the flight at which the messages of a topic arrived [ns]; absent: at that of the step."""


class Pacing(Protocol):
    """The steps of one node."""

    @property
    def readable(self) -> tuple[Topic, ...]:
        """The topics that this node may read."""

    @property
    def joined_late(self) -> bool:
        """Whether the flight ran already when this node joined it; known from its first step on."""

    def read(
        self,
        topic: str,
        decode: Callable[[Any], Stamped],
        raw: bool = False,
        decode_data: Callable[[bytes], Stamped] | None = None,
    ) -> None:
        """Read a topic; ``gather`` hands its messages over.

        Args:
            decode: takes a message, and raises RejectionError if it cannot be used, which is counted.
            raw: the message is passed to ``decode`` as it was serialized.
            decode_data: does the same for a message as it was serialized, faster.
        """

    def watch(self, topic: str, take: Callable[[bytes, int], None]) -> None:
        """Pass on every message of a topic as it arrives; ``gather`` hands those of a step over as well.

        A message whose stamp cannot belong to the flight so far is rejected and counted.

        Args:
            take: takes the serialized message and the wall time at which it was published [ns].
        """

    def steps(self) -> AsyncIterator[int]:
        """The steps of the flight, each when it begins for this node; one that is late may skip some.

        Raises:
            FlightError: the flight is over before its last step.
            StopRequestedError: by a signal.
        """

    async def gather(self, step: int, topics: Iterable[str] | None = None) -> Gathered:
        """The messages that are due in a step; a message may be older than the step in which it is due.

        Args:
            topics: which of the topics that the node reads or watches; None: all.
        Raises:
            FlightError: the flight is over before its last step.
            StopRequestedError: by a signal.
        """

    def publish(self, topic: str, message: Any, content: Stamped | None = None) -> None:
        """Send a message of the current step.

        Args:
            content: what its readers decode from it; those in the same process take this object instead.
        """

    def done(
        self,
        step: int,
        fault: str = "",
        promised: Iterable[str] = (),
        report: Callable[[], Mapping[str, object]] = dict,
        *,
        rests: bool = False,
    ) -> None:
        """Report that this node has finished a step; to be called once in each step that it gets.

        Args:
            fault: why the node cannot continue; empty: it can.
            rests: whether it is a vehicle on the ground with its motors off or idle.
            promised: topics of messages that the node publishes after this call, one each, before its next
                step; only observers may read them.
            report: called for what the node adds to its diagnostics, in the steps that have some.
        """

    async def leave(self) -> None:
        """Wait until the others have received what this node sent, when it ends before the last step."""
