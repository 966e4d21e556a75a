"""The messages of one node in real time: from their arrival until a step takes them."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from relform_ros.lockstep import Done
from relform_ros.rejection import Reason, RejectionError


@dataclass(frozen=True)
class Arrived:
    """A message, and when it came; instants of the flight [ns]."""

    stamp_ns: int
    arrival_ns: int
    message: Any


class Arrivals:
    """What has arrived, and whether it is all that the awaited members sent in a step.

    A member that skips steps reports the next one that it finishes, so newer reports stand for older ones.

    Args:
        awaited: members that report what they sent.
        leads_ns: by topic, how far the stamps of its messages lie ahead of the instants at which they are
            sent [ns]; others do not.
    """

    def __init__(self, awaited: Iterable[str], leads_ns: Mapping[str, int]) -> None:
        self._newest: dict[str, Done | None] = dict.fromkeys(awaited)
        self._leads_ns = leads_ns
        self._arrived: dict[str, list[Arrived]] = {}
        self.faulty = False
        """Whether an awaited member has reported that it cannot continue."""

    def open(self, topic: str) -> None:
        """Accept the messages of a topic."""
        self._arrived[topic] = []

    def add(self, topic: str, arrived: Arrived) -> None:
        """Keep a message that has arrived."""
        self._arrived[topic].append(arrived)

    def report(self, done: Done) -> None:
        """Take in that a member has finished a step.

        Raises:
            RejectionError: it is not awaited, or has finished this or a later step before.
        """
        if done.node not in self._newest:
            raise RejectionError(Reason.FOREIGN, f"'{done.node}' is not awaited here")
        if done.step < 0:
            return
        newest = self._newest[done.node]
        if newest is not None and done.step <= newest.step:
            raise RejectionError(Reason.STALE, f"{done.node} has finished step {newest.step} before")
        self._newest[done.node] = done
        self.faulty |= bool(done.fault)

    def complete(self, step: int) -> bool:
        """Whether all awaited members have finished a step, and what they sent in it has arrived."""
        reports = [done for done in self._newest.values() if done is not None and done.step >= step]
        return len(reports) == len(self._newest) and all(
            any(arrived.stamp_ns == stamp_ns for arrived in self._arrived[topic])
            for done in reports
            if done.step == step
            for topic, stamp_ns in done.sent
            if topic in self._arrived
        )

    def take(
        self, topics: Iterable[str], newest_ns: int | None, end_ns: int | None
    ) -> dict[str, tuple[Arrived, ...]]:
        """The messages that are due, by topic in the order of arrival; never empty.

        Args:
            newest_ns: instants after this one are left for a later step; None: none is.
            end_ns: what arrives from here on is left for a later step; None: nothing is.
        """
        taken = {}
        for topic in topics:
            lead_ns = self._leads_ns.get(topic, 0)
            due: list[Arrived] = []
            left: list[Arrived] = []
            for arrived in self._arrived[topic]:
                is_due = newest_ns is None or arrived.stamp_ns - lead_ns <= newest_ns
                in_time = end_ns is None or arrived.arrival_ns < end_ns
                (due if is_due and in_time else left).append(arrived)
            self._arrived[topic] = left
            if due:
                taken[topic] = tuple(due)
        return taken
