"""Pacing on the wall clock: a step begins when the clock ticks, and it takes what has arrived in time."""

from collections.abc import AsyncIterator, Callable, Iterable, Mapping
from typing import Any

from rclpy.node import Node

from relform_core.load import LoadedScenario
from relform_core.names import ROTOR_SPEEDS, vehicle_node, vehicle_topic
from relform_core.pacing_config import RealTimePacingConfig
from relform_core.roster import Roster
from relform_ros.ages import Ages
from relform_ros.arrivals import AHEAD_NS, Arrivals, Arrived
from relform_ros.flight_pacing import FlightPacing, Keep
from relform_ros.flight_time import FlightTime
from relform_ros.lockstep import Done, StepInbox
from relform_ros.pacing import Gathered, Stamped
from relform_ros.rejection import Reason, RejectionError
from relform_ros.spinner import Spinner

LAST_WAIT_NS = 1_000_000_000
"""How long an observer waits at the end of a flight for what was sent before [ns]."""

CATCH_UP_SHARE = 0.2
"""Share of the period that a controller which is late waits at most for the newest tick."""


class RealTimePacing(FlightPacing):
    """Waits for the ticks of the clock, and for messages until a deadline; implements ``Pacing``.

    Vehicles are the world: each takes part in every step, and waits for the ground truth of the others as in
    lock-step. A controller goes on to the newest step when it is late. It waits for the measurements of a
    step for a share of the period, all others for a whole one.

    Args:
        config: of the flight's ``pacing``.
    Raises:
        ConfigError: the node is no member of the flight.
    """

    def __init__(
        self,
        node: Node,
        spinner: Spinner,
        scenario: LoadedScenario,
        roster: Roster,
        config: RealTimePacingConfig,
    ) -> None:
        super().__init__(node, spinner, scenario, roster)
        commands = [vehicle_topic(vehicle, ROTOR_SPEEDS) for vehicle in roster.vehicles]
        self._leads_ns = dict.fromkeys(commands, scenario.config.command_lead_ns)
        self._arrivals = Arrivals(self._awaited, self._leads_ns, self._period_ns)
        self._is_vehicle = self._name in map(vehicle_node, roster.vehicles)
        self._decides = self._name in [controller.node for controller in roster.controllers]
        self._observes = self._name in roster.observers
        self._wait_ns = round((config.wait_share if self._decides else 1.0) * self._period_ns)
        self._topics: list[str] = []
        """What the node reads or watches."""
        self._inboxes: dict[str, StepInbox[Stamped | bytes]] = {}
        """Of the topics with one message in each step, for which the node waits."""
        self._time = FlightTime(self._period_ns)
        self._heard = 0
        """Messages that have arrived, without those for which the node waits in any case."""
        self._skipped = 0
        """Steps that the node took no part in."""
        self._incomplete = 0
        """Steps in which a message of the step had not arrived at the deadline."""
        self._ages = Ages()

    def _make_inbox(self, topic: str, reject: Callable[[RejectionError], None]) -> Keep:
        self._topics.append(topic)
        if self._is_vehicle and topic not in self._announced:
            inbox = self._inboxes[topic] = StepInbox[Stamped | bytes](self._period_ns, reject)
            return inbox.add
        self._arrivals.open(topic, is_single=not self._observes)

        def keep(stamp_ns: int, message: Any) -> None:
            self._heard += 1
            self._arrivals.add(topic, Arrived(stamp_ns, self._time.now_ns(), message))

        return keep

    def _take_tick(self, step: int) -> None:
        # Any later step may follow, because a node that was stopped misses ticks, but none of the future.
        is_next = step == self._newest_tick + 1
        ahead_ns = step * self._period_ns - self._time.now_ns()
        is_early = self._newest_tick >= 0 and not is_next and ahead_ns > AHEAD_NS
        if step > self._n_steps or is_early:
            raise RejectionError(Reason.EARLY, f"tick of step {step} after that of step {self._newest_tick}")
        self._heard += 1
        self._time.tick(step)

    def _take_done(self, done: Done) -> None:
        self._heard += 1
        self._arrivals.report(done, self._time.now_ns())

    async def steps(self) -> AsyncIterator[int]:
        """See ``Pacing``: joins the flight, then yields each step when the clock has reached it."""
        await self._join()
        step = self._newest_tick - 1
        while step < self._n_steps:
            await self._wait(lambda: self._newest_tick > step)  # noqa: B023  # not called later
            await self._hear_all()
            if self._decides:
                await self._hear_newest_tick()
            following = self._newest_tick if self._decides else step + 1
            self._skipped += following - step - 1
            step = following
            yield step
        await self.leave()

    async def gather(self, step: int, topics: Iterable[str] | None = None) -> Gathered:
        """See ``Pacing``."""
        topics = tuple(self._topics if topics is None else topics)
        due = {topic: {step * self._period_ns: 1} for topic in topics if topic in self._inboxes}
        await self._wait(lambda: all(self._inboxes[topic].has(stamps) for topic, stamps in due.items()))
        messages = {topic: tuple(self._inboxes[topic].take(step, stamps)) for topic, stamps in due.items()}
        loose = [topic for topic in topics if topic not in due]
        taken = await self._take(step, loose) if loose else {}
        messages |= {topic: tuple(arrived.message for arrived in each) for topic, each in taken.items()}
        arrivals_ns = {topic: tuple(arrived.arrival_ns for arrived in each) for topic, each in taken.items()}
        return Gathered(messages, self._arrivals.faulty, arrivals_ns)

    async def _take(self, step: int, topics: Iterable[str]) -> dict[str, tuple[Arrived, ...]]:
        """What arrives on topics without a fixed number of messages in time for a step."""
        instant_ns = step * self._period_ns
        await self._wait_until(instant_ns + self._wait_ns, step)
        is_last = self._observes and (step == self._n_steps or self._arrivals.faulty)
        if is_last:
            await self._wait_until(instant_ns + LAST_WAIT_NS, step)
        if not self._arrivals.complete(step):
            await self._hear_all()
        if not self._arrivals.complete(step):
            self._incomplete += 1
        newest_ns = None if is_last else instant_ns
        end_ns = instant_ns + self._period_ns if self._is_vehicle else None
        taken = self._arrivals.take(topics, newest_ns, end_ns)
        self._note_ages(taken)
        return taken

    async def _hear_all(self) -> None:
        """Run the callbacks of everything that has come to this process: a node that is late has not yet."""
        heard = -1
        while heard != self._heard:
            heard = self._heard
            turns = iter((False, True))
            await self._wait(lambda: next(turns), deadline=0.0)  # noqa: B023  # not called later

    async def _hear_newest_tick(self) -> None:
        """Wait shortly if the newest tick is older than a period: a later one must be under way."""
        end_ns = self._time.now_ns() + round(CATCH_UP_SHARE * self._period_ns)

        def is_over() -> bool:
            now_ns = self._time.now_ns()
            return now_ns < (self._newest_tick + 1) * self._period_ns or now_ns >= end_ns

        await self._wait(is_over, self._time.steady(end_ns))

    async def _wait_until(self, instant_ns: int, step: int) -> None:
        """Wait until an instant of the flight, or until all messages of a step have arrived."""
        await self._wait(
            lambda: self._time.now_ns() >= instant_ns or self._arrivals.complete(step),
            self._time.steady(instant_ns),
        )

    def _note_ages(self, taken: Mapping[str, tuple[Arrived, ...]]) -> None:
        """Count how old measurements are at a decision, and commands when they reach a vehicle."""
        now_ns = self._time.now_ns()
        for topic, each in taken.items():
            for arrived in each:
                used_ns = now_ns if self._decides else arrived.arrival_ns
                self._ages.add(used_ns - arrived.stamp_ns + self._leads_ns.get(topic, 0))

    def _own_report(self) -> Mapping[str, object]:
        return {
            "real_time.skipped_steps": self._skipped,
            "real_time.incomplete_steps": self._incomplete,
            **self._ages.report("real_time.age"),
        }
