"""What every pacing does: join a flight, hear its clock, send messages and report the ends of steps."""

import math
import secrets
import time
from abc import ABC, abstractmethod
from collections.abc import AsyncIterator, Callable, Collection, Iterable, Mapping
from functools import partial
from typing import Any

from rclpy.node import Node
from rosgraph_msgs.msg import Clock

from relform_core.errors import FlightError
from relform_core.load import LoadedScenario
from relform_core.names import CLOCK, CLOCK_NODE, DIAGNOSTICS, MEMBERS, step_done_topic
from relform_core.roster import Roster
from relform_core.units import NANOSECONDS_PER_SECOND
from relform_msgs.msg import MemberChange as MemberChangeMsg
from relform_msgs.msg import StepDone
from relform_ros.diagnostics import Diagnostics, is_due
from relform_ros.discovery import check_name, discover
from relform_ros.endpoints import Endpoints
from relform_ros.fields import stamp_from_msg
from relform_ros.lockstep import JOINED, READY, Done, step_at
from relform_ros.member_changes import change_from_msg
from relform_ros.membership import MemberChange, Verdict
from relform_ros.pacing import Gathered, Stamped
from relform_ros.raw import raw_stamp_ns
from relform_ros.rejection import Reason, RejectionError
from relform_ros.spinner import Spinner, until, until_instant
from relform_ros.step_done import done_from_msg, done_to_msg
from relform_ros.topics import Topic, topic_table

CLOCK_POLL_S = 1.0
"""How often a node checks that the clock of its flight still exists."""
FAREWELL_S = 1.0
"""How long a node that ends waits until the others have received what it sent."""
LEAVE_APART_S = 0.05
"""Time between the ends of two nodes: Fast DDS 2.14 can block for ever when they leave at the same time."""

ANSWER_S = 10.0
"""How long a node that joins a running flight waits for the answer of the clock."""
ASK_AGAIN_S = 1.0
"""How often it asks meanwhile."""
PROCESS_BITS = 63

Keep = Callable[[int, Any], None]
"""Takes a message that has arrived, with its stamp [ns]; may raise RejectionError."""


def configuration_of(scenario: LoadedScenario, roster: Roster) -> str:
    """What all nodes of a flight must agree on: a hash of the scenario and its seed, and the observers."""
    return " ".join((scenario.fingerprint, *sorted(roster.observers)))


class FlightPacing(ABC):
    """The common part of all that implement ``Pacing``.

    Raises:
        ConfigError: the node is no member of the flight.
    """

    def __init__(self, node: Node, spinner: Spinner, scenario: LoadedScenario, roster: Roster) -> None:
        config = scenario.config
        self._name = node.get_fully_qualified_name()
        check_name(self._name, roster.members)
        self._place = roster.members.index(self._name)
        self._configuration = configuration_of(scenario, roster)
        self._endpoints = Endpoints(node, topic_table(config, roster), spinner.intra_process)
        self._diagnostics = Diagnostics(self._name, self._endpoints.rejections)
        readable = {topic.name for topic in self.readable}
        self._awaited = tuple(member for member in roster.members if step_done_topic(member) in readable)
        """The nodes that report the end of their steps to this one."""
        self._announced = {
            topic.name for topic in self.readable if not set(topic.writers).isdisjoint(self._awaited)
        }
        """Topics of which these reports list the messages."""
        self._period_ns = config.period_ns
        self._n_steps = config.n_steps
        self._sent: list[tuple[str, int]] = []
        self._promised: list[str] = []
        self._newest_tick = -1
        self._first_tick = -1
        """The first step that this node has heard of; -1: none."""
        self._process = 0 if config.real_time is None else secrets.randbits(PROCESS_BITS)
        """See ``Done.process``; in lock-step, where no process is replaced, messages are always the same."""
        self._observers = roster.observers
        self._next_asking, self._answer_until = -math.inf, math.inf
        """When this process next asks to join, and until when it waits for the answer; steady times [s]."""
        self._is_admitted = False
        """Whether the clock has let this process join the running flight."""
        self._takes_part = False
        """Whether this process has begun its first step."""
        self._shut_out = ""
        """Why this process must end; empty: it need not."""
        self._next_look = -math.inf
        self._missed_clock = False
        self._endpoints.subscribe(CLOCK, self._on_clock)
        self._endpoints.subscribe(MEMBERS, self._on_member_change)
        for member in self._awaited:
            self._endpoints.subscribe(step_done_topic(member), partial(self._on_step_done, member))

    @abstractmethod
    def _make_inbox(self, topic: str, reject: Callable[[RejectionError], None]) -> Keep:
        """Make room for the messages of a topic; returns what takes them.

        Args:
            reject: called with the reason for each message that no step uses.
        """

    @abstractmethod
    def _take_tick(self, step: int) -> None:
        """The clock has reached a step, later than the newest tick; may raise RejectionError."""

    @abstractmethod
    def _take_done(self, done: Done) -> None:
        """A node that is awaited has finished a step; may raise RejectionError."""

    def _own_report(self) -> Mapping[str, object]:
        """What the pacing adds to the diagnostics of its node."""
        return {}

    @property
    def readable(self) -> tuple[Topic, ...]:
        """See ``Pacing``."""
        return self._endpoints.readable

    @property
    def joined_late(self) -> bool:
        """See ``Pacing``."""
        return self._first_tick > 0

    def read(
        self,
        topic: str,
        decode: Callable[[Any], Stamped],
        raw: bool = False,
        decode_data: Callable[[bytes], Stamped] | None = None,
    ) -> None:
        """See ``Pacing``."""
        keep = self._make_inbox(topic, partial(self._endpoints.rejections.count, topic))

        def take(message: Stamped) -> None:
            keep(message.stamp_ns, message)

        if raw:
            self._endpoints.subscribe_raw(topic, lambda data, publish_time_ns: take(decode(data)))
        else:
            take_data = None if decode_data is None else lambda data: take(decode_data(data))
            self._endpoints.subscribe(topic, lambda msg: take(decode(msg)), take, take_data)

    def watch(self, topic: str, take: Callable[[bytes, int], None]) -> None:
        """See ``Pacing``."""
        keep = self._make_inbox(topic, lambda _: None)

        def keep_and_take(data: bytes, publish_time_ns: int) -> None:
            keep(raw_stamp_ns(data), data)
            take(data, publish_time_ns)

        self._endpoints.subscribe_raw(topic, keep_and_take)

    @abstractmethod
    def steps(self) -> AsyncIterator[int]:
        """See ``Pacing``."""

    @abstractmethod
    async def gather(self, step: int, topics: Iterable[str] | None = None) -> Gathered:
        """See ``Pacing``."""

    def publish(self, topic: str, message: Any, content: Stamped | None = None) -> None:
        """See ``Pacing``."""
        self._endpoints.publish(topic, message, content)
        if topic in self._promised:
            self._promised.remove(topic)
        else:
            self._sent.append((topic, stamp_from_msg(message.header.stamp)))

    def done(
        self,
        step: int,
        fault: str = "",
        promised: Iterable[str] = (),
        report: Callable[[], Mapping[str, object]] = dict,
        *,
        rests: bool = False,
    ) -> None:
        """See ``Pacing``."""
        stamp_ns = step * self._period_ns
        if is_due(step, self._period_ns):
            values = {**report(), **self._own_report()}
            self.publish(DIAGNOSTICS, self._diagnostics.report(stamp_ns, values))
        self._promised = list(promised)
        self._sent += [(topic, stamp_ns) for topic in self._promised]
        self._send_done(step, stamp_ns, fault, rests)

    async def leave(self) -> None:
        """See ``Pacing``."""
        self._endpoints.wait_until_received(FAREWELL_S)
        await until_instant(time.monotonic() + self._place * LEAVE_APART_S)

    async def _join(self) -> None:
        """Join the flight, find the other nodes, report that it may start, and wait for its first step.

        Raises:
            FlightError: the flight runs, and goes on without this process.
        """
        self._ask_to_join()
        await discover(self._name, self._endpoints, self._may_begin, self._spare)
        if not self.joined_late:
            self._send_done(READY, stamp_ns=0, fault="")
        await self._wait(lambda: self._newest_tick >= 0)
        await self._wait(self._may_begin)
        self._takes_part = True

    def _ask_to_join(self) -> None:
        joined = Done(self._name, JOINED, (), "", self._configuration, self._process)
        self._endpoints.publish(step_done_topic(self._name), done_to_msg(joined, stamp_ns=0))
        self._next_asking = time.monotonic() + ASK_AGAIN_S

    def _may_begin(self) -> bool:
        """Whether the flight waits for this node, or has let it join; asks again until it is answered."""
        self._check_shut_out()
        if self._is_admitted or not self.joined_late:
            return True
        now = time.monotonic()
        self._answer_until = min(self._answer_until, now + ANSWER_S)
        if now > self._answer_until:
            raise FlightError(f"the flight runs, and {CLOCK_NODE} does not let another process join")
        if now > self._next_asking:
            self._ask_to_join()
        return False

    def _spare(self) -> Collection[str]:
        """The nodes without which this one begins: in a running flight, those that no vehicle needs."""
        return self._observers if self.joined_late else ()

    def _check_shut_out(self) -> None:
        if self._shut_out:
            raise FlightError(self._shut_out)

    async def _wait(self, condition: Callable[[], bool], deadline: float = math.inf) -> None:
        """Wait as ``until`` does, while the clock of the flight exists."""

        def holds() -> bool:
            self._check_shut_out()
            if condition():
                return True
            self._look_for_clock()
            return False

        await until(holds, deadline=deadline)

    def _look_for_clock(self) -> None:
        """Find out whether the clock is gone for good; before its first tick another may be started."""
        if self._newest_tick < 0 or time.monotonic() < self._next_look:
            return
        self._next_look = time.monotonic() + CLOCK_POLL_S
        is_gone = CLOCK_NODE in self._endpoints.absent(CLOCK)
        if is_gone and self._missed_clock:
            seconds = self._newest_tick * self._period_ns / NANOSECONDS_PER_SECOND
            when = f"step {self._newest_tick} ({seconds:.2f} s)"
            raise FlightError(f"{CLOCK_NODE} has gone in {when}: the flight is over")
        self._missed_clock = is_gone

    def _on_clock(self, msg: Clock) -> None:
        step = step_at(stamp_from_msg(msg.clock), self._period_ns)
        if step <= self._newest_tick:
            raise RejectionError(Reason.STALE, f"tick of step {step} after that of step {self._newest_tick}")
        self._take_tick(step)
        self._newest_tick = step
        if self._first_tick < 0:
            self._first_tick = step

    def _on_member_change(self, msg: MemberChangeMsg) -> None:
        change = change_from_msg(msg)
        if change.node == self._name:
            self._take_change(change)

    def _take_change(self, change: MemberChange) -> None:
        """The clock has decided on this process, or on another one of this name."""
        is_own = change.process == self._process
        match change.verdict:
            case Verdict.REFUSED if is_own and not self._takes_part:  # in lock-step all have the same number
                self._shut_out = f"refused in step {change.step}: {change.reason}"
            case Verdict.ADMITTED if is_own:
                self._is_admitted = True
            case Verdict.ADMITTED if self._takes_part:
                self._shut_out = f"another process is {self._name} since step {change.step}: {change.reason}"

    def _on_step_done(self, member: str, msg: StepDone) -> None:
        self._take_done(done_from_msg(msg, member))

    def _send_done(self, step: int, stamp_ns: int, fault: str, rests: bool = False) -> None:
        done = Done(self._name, step, tuple(self._sent), fault, rests=rests)
        self._endpoints.publish(step_done_topic(self._name), done_to_msg(done, stamp_ns))
        self._sent = []
