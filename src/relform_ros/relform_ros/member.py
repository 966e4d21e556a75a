"""A member of the lock-step barrier: waits for the others, follows the clock, says when it has finished."""

import math
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any

from rclpy.node import Node
from rosgraph_msgs.msg import Clock

from relform_core.errors import ConfigError, FlightError
from relform_core.load import LoadedScenario
from relform_core.names import CLOCK, CLOCK_NODE, DIAGNOSTICS, step_done_topic
from relform_msgs.msg import StepDone
from relform_ros.diagnostics import diagnostics_to_msg, is_due
from relform_ros.endpoints import Endpoints
from relform_ros.fields import stamp_from_msg
from relform_ros.lockstep import JOINED, READY, Announcements, Done, step_at
from relform_ros.rejection import Reason, RejectionError
from relform_ros.run_node import Spinner
from relform_ros.step_done import done_from_msg, done_to_msg
from relform_ros.topics import members, topic_table

DISCOVERY_POLL_S = 0.01
"""Nothing wakes a node when its picture of the graph changes, so during discovery it looks this often."""
DISCOVERY_PATIENCE_S = 5.0
"""After this time a node says for whom it is waiting, and goes on waiting; it is the clock that gives up."""
CLOCK_POLL_S = 1.0
"""How often a node looks whether the clock of its flight is still there."""
FAREWELL_S = 1.0
"""How long a node that ends waits until all that it has sent was received."""


def configuration_of(scenario: LoadedScenario, observers: Sequence[str]) -> str:
    """What all nodes of a flight must agree on: a hash of the scenario and its seed, and the observers."""
    return " ".join((scenario.fingerprint, *sorted(observers)))


class LockstepMember:
    """The barrier seen from one of its members.

    Args:
        observers: the members beside vehicles and controller.
    Raises:
        ConfigError: the node is no member.
    """

    def __init__(
        self, node: Node, spinner: Spinner, scenario: LoadedScenario, observers: Sequence[str]
    ) -> None:
        config = scenario.config
        self._name = node.get_fully_qualified_name()
        check_name(self._name, members(config.team, observers))
        self._configuration = configuration_of(scenario, observers)
        self.endpoints = Endpoints(node, topic_table(config, observers))
        readable = {topic.name for topic in self.endpoints.readable}
        awaited = [
            member for member in members(config.team, observers) if step_done_topic(member) in readable
        ]
        self.announcements = Announcements(awaited)
        """What the members have sent whose messages this one reads; the owner closes the steps."""
        self.report: Callable[[], Mapping[str, object]] = dict
        """What the node adds to its diagnostics, once per second of simulation time."""
        self._spinner = spinner
        self._period_ns = config.period_ns
        self._n_steps = config.n_steps
        self._sent: list[str] = []
        self._newest_tick = -1
        self._next_look = -math.inf
        self._missed_clock = False
        self.endpoints.subscribe(CLOCK, self._on_clock)
        for member in awaited:
            self.endpoints.subscribe(step_done_topic(member), partial(self._on_step_done, member))

    def publish(self, topic: str, message: Any) -> None:
        """Send a message that belongs to the current step."""
        self.endpoints.publish(topic, message)
        self._sent.append(topic)

    def wait(self, condition: Callable[[], bool]) -> None:
        """Let messages come in until a condition holds.

        Raises:
            FlightError: the clock has ended the flight.
            StopRequestedError: by a signal.
        """
        while not condition():
            self._spinner.once()
            self._look_for_clock()

    def steps(self) -> Iterator[int]:
        """Wait for all members, then yield the number of each step when the clock has reached it.

        Raises:
            FlightError: the clock has ended the flight.
            StopRequestedError: by a signal.
        """
        joined = Done(self._name, JOINED, (), "", self._configuration)
        self.endpoints.publish(step_done_topic(self._name), done_to_msg(joined, stamp_ns=0))
        discover(self._name, self.endpoints, self._spinner)
        self._send_done(READY, stamp_ns=0, fault="")
        for step in range(self._n_steps + 1):
            self.wait(lambda: self._newest_tick >= step)  # noqa: B023  # called before the loop goes on
            yield step
        self.endpoints.wait_until_received(FAREWELL_S)

    def done(self, step: int, fault: str = "", promised: Iterable[str] = ()) -> None:
        """Tell all members that this one has finished a step; to be called in each step.

        Args:
            fault: why the run cannot go on; empty: it can.
            promised: topics of further messages of this step, for observers; ``fulfil`` must follow.
        """
        stamp_ns = step * self._period_ns
        self._sent += promised
        if is_due(step, self._period_ns):
            report = diagnostics_to_msg(stamp_ns, self._name, self.endpoints.rejections, self.report())
            self.publish(DIAGNOSTICS, report)
        self._send_done(step, stamp_ns, fault)

    def fulfil(self, topic: str, message: Any) -> None:
        """Send a message that was promised."""
        self.endpoints.publish(topic, message)

    def _look_for_clock(self) -> None:
        """Find out whether the clock is gone for good; before its first tick another may be started."""
        if self._newest_tick < 0 or time.monotonic() < self._next_look:
            return
        self._next_look = time.monotonic() + CLOCK_POLL_S
        is_gone = CLOCK_NODE in self.endpoints.absent(CLOCK)
        if is_gone and self._missed_clock:
            when = f"step {self._newest_tick} ({self._newest_tick * self._period_ns * 1e-9:.2f} s)"
            raise FlightError(f"{CLOCK_NODE} has gone in {when}: the flight is over")
        self._missed_clock = is_gone

    def _on_clock(self, msg: Clock) -> None:
        step = step_at(stamp_from_msg(msg.clock), self._period_ns)
        if step <= self._newest_tick:
            raise RejectionError(Reason.STALE, f"tick of step {step} after that of step {self._newest_tick}")
        if step > self._newest_tick + 1:
            raise RejectionError(Reason.EARLY, f"tick of step {step} after that of step {self._newest_tick}")
        self._newest_tick = step

    def _on_step_done(self, member: str, msg: StepDone) -> None:
        self.announcements.add(done_from_msg(msg, member))

    def _send_done(self, step: int, stamp_ns: int, fault: str) -> None:
        done = Done(self._name, step, tuple(self._sent), fault)
        self.endpoints.publish(step_done_topic(self._name), done_to_msg(done, stamp_ns))
        self._sent = []


def discover(
    name: str, endpoints: Endpoints, spinner: Spinner, is_ready: Callable[[], bool] = lambda: True
) -> None:
    """Wait until a node's partners are connected and it is ready; say for whom, once, if that takes long.

    Raises:
        StopRequestedError: by a signal.
    """
    deadline = time.monotonic() + DISCOVERY_PATIENCE_S
    unmatched = endpoints.unmatched()
    while not is_ready() or unmatched:
        spinner.once(DISCOVERY_POLL_S)
        unmatched = endpoints.unmatched(among=unmatched)
        if unmatched and time.monotonic() > deadline:
            deadline = math.inf
            absent = {node for topic in unmatched for node in endpoints.absent(topic)}
            awaited = absent or {node for topic in unmatched for node in endpoints.partners(topic)}
            print(f"{name}: still waiting for {', '.join(sorted(awaited))}", file=sys.stderr)


def check_name(name: str, known: Sequence[str]) -> None:
    """Whether a node is called as the others expect it.

    Raises:
        ConfigError: it is not.
    """
    if name not in known:
        raise ConfigError(
            f"the others know no such node, but {', '.join(known)}: leave -r __node:= away, and -r __ns:= "
            "if this is no vehicle"
        )
