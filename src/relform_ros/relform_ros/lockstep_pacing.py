"""Pacing in lock-step: a step begins when the clock ticks, and it ends when its messages have arrived."""

from collections.abc import AsyncIterator, Callable, Iterable

from rclpy.node import Node

from relform_core.load import LoadedScenario
from relform_core.names import MEMBERS
from relform_core.roster import Roster
from relform_ros.flight_pacing import FlightPacing, Keep
from relform_ros.lockstep import Announcements, Done, StepInbox
from relform_ros.pacing import Gathered, Stamped
from relform_ros.rejection import Reason, RejectionError
from relform_ros.spinner import Spinner


class LockstepPacing(FlightPacing):
    """Waits for the ticks of the clock and for all messages of a step; implements ``Pacing``.

    Some writers report the end of their steps to this node: the messages that they list are due in that step.
    On all other topics one message is due, with the stamp of the step; but none of the clock's decisions on
    nodes, which come at any time.

    Raises:
        ConfigError: the node is no member of the flight.
    """

    def __init__(self, node: Node, spinner: Spinner, scenario: LoadedScenario, roster: Roster) -> None:
        super().__init__(node, spinner, scenario, roster)
        self._announcements = Announcements(self._awaited)
        self._inboxes: dict[str, StepInbox[Stamped | bytes]] = {}
        self._lead = scenario.config.command_lead_steps

    def _make_inbox(self, topic: str, reject: Callable[[RejectionError], None]) -> Keep:
        inbox = self._inboxes[topic] = StepInbox[Stamped | bytes](self._period_ns, reject, self._lead)
        return inbox.add

    def _take_tick(self, step: int) -> None:
        if step > self._newest_tick + 1:
            raise RejectionError(Reason.EARLY, f"tick of step {step} after that of step {self._newest_tick}")

    def _take_done(self, done: Done) -> None:
        self._announcements.add(done)

    async def steps(self) -> AsyncIterator[int]:
        """See ``Pacing``: joins the flight, then yields each step when the clock has reached it."""
        await self._join()
        for step in range(self._n_steps + 1):
            await self._wait(lambda: self._newest_tick >= step)  # noqa: B023  # not called later
            yield step
        await self.leave()

    async def gather(self, step: int, topics: Iterable[str] | None = None) -> Gathered:
        """See ``Pacing``."""
        topics = tuple(self._inboxes if topics is None else topics)
        due: dict[str, dict[int, int]] = {MEMBERS: {}} if MEMBERS in topics else {}
        due |= {
            topic: {step * self._period_ns: 1} for topic in topics if topic not in {*self._announced, MEMBERS}
        }
        announced, faulty = self._announced.intersection(topics), False
        if announced:
            due |= await self._wait_for_announcements(step, announced)
            faulty = self._announcements.faulty(step)
            self._announcements.close(step)
        await self._wait(lambda: all(self._inboxes[topic].has(stamps) for topic, stamps in due.items()))
        taken = {topic: self._inboxes[topic].take(step, due[topic]) for topic in topics}
        return Gathered({topic: tuple(each) for topic, each in taken.items() if each}, faulty)

    async def _wait_for_announcements(self, step: int, topics: Iterable[str]) -> dict[str, dict[int, int]]:
        """Number of messages that were sent in a step on some topics, by topic and stamp [ns]."""
        await self._wait(lambda: self._announcements.complete(step))
        due: dict[str, dict[int, int]] = {topic: {} for topic in topics}
        for (topic, stamp_ns), number in self._announcements.sent(step).items():
            if topic in due:
                due[topic][stamp_ns] = number
        return due
