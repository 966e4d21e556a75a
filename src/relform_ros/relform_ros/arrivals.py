"""The messages of one node in real time: from their arrival until a step takes them."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from relform_ros.lockstep import Done, step_at
from relform_ros.rejection import Reason, RejectionError

PAST_NS = 5_000_000_000
"""How old a message may be when it arrives [ns]: more than links delay it."""
AHEAD_NS = 1_000_000_000
"""What is further ahead of the flight's time was not sent by a node of the flight [ns]. It is not 0, because
the time of a node lags that has heard late ticks only, or has not come to hear them yet."""


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
        period_ns: length of a step.
    """

    def __init__(self, awaited: Iterable[str], leads_ns: Mapping[str, int], period_ns: int) -> None:
        self._newest: dict[str, Done | None] = dict.fromkeys(awaited)
        self._leads_ns = leads_ns
        self._period_ns = period_ns
        self._arrived: dict[str, list[Arrived]] = {}
        self._stamps_ns: dict[str, set[int]] = {}
        """Stamps of what has arrived lately, by topic with one message of each stamp."""
        self.faulty = False
        """Whether an awaited member has reported that it cannot continue."""

    def open(self, topic: str, is_single: bool = False) -> None:
        """Accept the messages of a topic; single: there is one of each stamp."""
        self._arrived[topic] = []
        if is_single:
            self._stamps_ns[topic] = set()

    def add(self, topic: str, arrived: Arrived) -> None:
        """Keep a message that has arrived.

        Raises:
            RejectionError: no step begins at its stamp, no node can have reached that step, it is long over,
                or the topic has a message of this stamp already.
        """
        step_at(arrived.stamp_ns, self._period_ns)
        ahead_ns = arrived.stamp_ns - self._leads_ns.get(topic, 0) - arrived.arrival_ns
        if ahead_ns > AHEAD_NS:
            raise RejectionError(Reason.EARLY, f"stamp {arrived.stamp_ns} ns is {ahead_ns} ns ahead")
        if (known := self._stamps_ns.get(topic)) is not None:
            oldest_ns = arrived.arrival_ns - PAST_NS
            if arrived.stamp_ns < oldest_ns:
                raise RejectionError(Reason.STALE, f"stamp {arrived.stamp_ns} ns is {-ahead_ns} ns old")
            if arrived.stamp_ns in known:
                raise RejectionError(Reason.DUPLICATE, f"stamp {arrived.stamp_ns} ns has a message already")
            known.add(arrived.stamp_ns)
            if len(known) * self._period_ns > 2 * PAST_NS:
                self._stamps_ns[topic] = {each for each in known if each >= oldest_ns}
        self._arrived[topic].append(arrived)

    def report(self, done: Done, now_ns: int) -> None:
        """Take in that a member has finished a step, at an instant of the flight [ns].

        Raises:
            RejectionError: it is not awaited, has finished this or a later step before, or cannot have
                reached it.
        """
        if done.node not in self._newest:
            raise RejectionError(Reason.FOREIGN, f"'{done.node}' is not awaited here")
        if done.step < 0:
            return
        if done.step * self._period_ns - AHEAD_NS > now_ns:
            raise RejectionError(Reason.EARLY, f"{done.node} cannot have finished step {done.step} yet")
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
