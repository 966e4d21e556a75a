"""The monitor: what live line and summary show of a flight, and the member of the barrier that reads it."""

import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from typing import Any

import numpy as np
import rclpy
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import try_shutdown

from relform_analysis.flight.from_bag import message_takers
from relform_analysis.flight.log import FlightLog
from relform_analysis.flight.log_builder import FlightLogBuilder
from relform_analysis.flight.tracking_errors import formation_errors, scored_pairs
from relform_bringup.message_store import MessageStore
from relform_core.errors import ConfigError
from relform_core.flight_modes import TeamMode
from relform_core.load import LoadedScenario
from relform_core.names import (
    EVENTS,
    GROUND_TRUTH,
    MONITOR_NODE,
    REFERENCE,
    SOLVER,
    STATUS,
    EventKind,
    SolverState,
    split_node_name,
)
from relform_core.roster import Roster
from relform_core.units import NANOSECONDS_PER_SECOND
from relform_ros.make_pacing import make_pacing
from relform_ros.pacing import Pacing
from relform_ros.parameters import read_observers, read_scenario
from relform_ros.raw import decoded, raw_stamp_ns
from relform_ros.rejection import RejectionError
from relform_ros.run_node import Runnable
from relform_ros.spinner import Spinner
from relform_ros.step_pipe import PIPE, StepMessages, StepPipe, read_step_pipe
from relform_ros.topics import Topic, topic_table

RECENT_STEPS = 3
"""Among the messages of this many steps is one step of which all have arrived."""


class Monitor:
    """Sees every step whole. Messages are stored serialized, and decoded when they are needed."""

    def __init__(
        self,
        scenario: LoadedScenario,
        topics: Iterable[Topic],
        store: MessageStore,
        on_step: Callable[["Monitor"], None],
    ) -> None:
        """Start before the first step.

        Args:
            topics: see ``logged_topics``.
            on_step: called at the end of each step.
        """
        self.step = -1
        """The newest step that was seen whole; -1: none."""
        self.fallbacks = 0
        """Number of control steps whose SQP step failed."""
        self._scenario = scenario
        self._on_step = on_step
        self._began = self._now = 0.0
        self._store = store
        self._types = {topic.name: topic.type for topic in topics}
        self._recent: deque[tuple[str, bytes]] = deque(maxlen=RECENT_STEPS * len(self._types))

    def take(self, messages: StepMessages) -> None:
        """Take in the next step; messages of other topics are left out."""
        self._now = time.perf_counter()
        if self.step < 0:
            self._began = self._now
        for topic, data in messages:
            if topic in self._types:
                self._keep(topic, data)
        self.step += 1
        self._on_step(self)

    @property
    def flown(self) -> float:
        """Simulation time that was flown [s]."""
        return max(0, self.step) * self._scenario.config.period_ns / NANOSECONDS_PER_SECOND

    @property
    def wall_time(self) -> float:
        """Wall time since the first step [s]."""
        return self._now - self._began

    def formation_error(self) -> float | None:
        """Mean true formation error of the scored pairs in the newest step [m]; None: unknown."""
        log = self._decode(
            (topic, data) for topic, data in self._recent if topic.endswith((f"/{GROUND_TRUTH}", REFERENCE))
        )
        if not log.phase:
            return None
        return float(np.mean(formation_errors(log, scored_pairs(self._scenario.config.team))[-1]))

    def waiting_for(self) -> str:
        """What the controller waits for before its first command; empty: it does not wait."""
        return next((event.description for event in self._latest(EVENTS) if event.kind == EventKind.STEP), "")

    def team_mode(self) -> TeamMode | None:
        """What the team does in the newest step; None: it starts airborne, or nothing was seen."""
        known = [mode.value for mode in TeamMode]
        return next((TeamMode(status.mode) for status in self._latest(STATUS) if status.mode in known), None)

    def log(self) -> FlightLog:
        """The flight so far."""
        return self._decode(self._store)

    def _latest(self, topic: str) -> Iterator[Any]:
        """The recent messages of a topic that can be decoded, the newest first."""
        for name, data in reversed(self._recent):
            if name == topic:
                with suppress(RejectionError):
                    yield decoded(data, self._types[topic])

    def _decode(self, messages: Iterable[tuple[str, bytes]]) -> FlightLog:
        builder = FlightLogBuilder(self._scenario)
        takers = message_takers(builder, self._scenario.config)
        for topic, data in messages:
            with suppress(RejectionError):
                takers[topic](decoded(data, self._types[topic]))
        return builder.build()

    def _keep(self, topic: str, data: bytes) -> None:
        self._store.add(topic, data)
        self._recent.append((topic, data))
        if topic == SOLVER:
            with suppress(RejectionError):
                self.fallbacks += decoded(data, self._types[topic]).status == SolverState.FALLBACK


@dataclass(frozen=True)
class _Serialized:
    """A message as it was serialized."""

    data: bytes

    @property
    def stamp_ns(self) -> int:
        return raw_stamp_ns(self.data)


class MonitorNode:
    """Reads a flight, and hands the logged messages of each step over."""

    def __init__(self, pacing: Pacing, topics: Iterable[Topic], take: Callable[[StepMessages], None]) -> None:
        self._pacing = pacing
        self._take = take
        for topic in topics:
            pacing.read(topic.name, decode=_Serialized, raw=True)

    async def run(self) -> None:
        """Watch the flight to its end.

        Raises:
            StopRequestedError: by a signal.
        """
        async for step in self._pacing.steps():
            gathered = (await self._pacing.gather(step)).messages
            self._take([(topic, message.data) for topic, each in gathered.items() for message in each])
            self._pacing.done(step)


def logged_topics(scenario: LoadedScenario, observers: Sequence[str]) -> list[Topic]:
    """The topics of which the log of a flight is made."""
    logged = message_takers(FlightLogBuilder(scenario), scenario.config)
    table = topic_table(scenario.config, Roster.of(scenario.config, observers))
    return [topic for topic in table.values() if topic.name in logged]


@contextmanager
def monitoring(
    scenario: LoadedScenario,
    observers: Sequence[str],
    topics: Iterable[Topic],
    take: Callable[[StepMessages], None],
    watch: Callable[[], None],
) -> Iterator[Callable[[], None]]:
    """The node in this process, while the block runs; gives what runs it to the end of the flight.

    Args:
        topics: see ``logged_topics``.
        take: called with each step.
        watch: called repeatedly while the node waits.
    """
    rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)
    try:
        node = create_monitor()
        spinner = Spinner(node, watch=watch)
        pacing = make_pacing(node, spinner, scenario, Roster.of(scenario.config, observers))
        logic = MonitorNode(pacing, topics, take)
        yield lambda: spinner.run([logic.run()])
    finally:
        try_shutdown()


def create_monitor() -> Node:
    """The node, without its logic."""
    return rclpy.create_node(split_node_name(MONITOR_NODE)[1], enable_rosout=False)


def build_remote_monitor(node: Node, spinner: Spinner) -> Runnable:
    """The node in another process than ``fly``, which gets the steps by a pipe.

    Raises:
        ConfigError: a parameter is missing or not usable.
    """
    scenario, observers, pipe = read_scenario(node), read_observers(node), read_step_pipe(node)
    if pipe is None:
        raise ConfigError(f"parameter {PIPE} is not set: leave {MONITOR_NODE} out of the observers")
    pacing = make_pacing(node, spinner, scenario, Roster.of(scenario.config, observers))
    return _RemoteMonitor(pacing, logged_topics(scenario, observers), pipe)


class _RemoteMonitor:
    def __init__(self, pacing: Pacing, topics: Iterable[Topic], pipe: StepPipe) -> None:
        self._pipe = pipe
        self._logic = MonitorNode(pacing, topics, pipe.send)

    async def run(self) -> None:
        with self._pipe:
            await self._logic.run()
