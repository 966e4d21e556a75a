"""The monitor: a member of the barrier that stores the messages of a flight for live line and summary."""

import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np
import rclpy
from rclpy.serialization import deserialize_message
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import try_shutdown

from relform_analysis.flight.from_bag import message_takers
from relform_analysis.flight.log import FlightLog
from relform_analysis.flight.log_builder import FlightLogBuilder
from relform_analysis.flight.tracking_errors import formation_errors, scored_pairs
from relform_bringup.message_store import MessageStore
from relform_core.load import LoadedScenario
from relform_core.names import (
    EVENTS,
    GROUND_TRUTH,
    MONITOR_NODE,
    REFERENCE,
    SOLVER,
    EventKind,
    SolverState,
    split_node_name,
)
from relform_core.roster import Roster
from relform_core.units import NANOSECONDS_PER_SECOND
from relform_ros.lockstep_pacing import LockstepPacing
from relform_ros.pacing import Pacing
from relform_ros.raw import raw_stamp_ns
from relform_ros.spinner import Spinner

RECENT_STEPS = 3
"""Among the messages of this many steps is one step of which all have arrived."""


class Monitor:
    """Sees every step whole. Messages are stored serialized, and decoded when they are needed."""

    def __init__(
        self,
        scenario: LoadedScenario,
        pacing: Pacing,
        store: MessageStore,
        on_step: Callable[["Monitor"], None],
    ) -> None:
        """``on_step`` is called at the end of each step."""
        self.step = -1
        """The newest step that was seen whole; -1: none."""
        self.fallbacks = 0
        """Number of control steps whose SQP step failed."""
        self._scenario = scenario
        self._on_step = on_step
        self._began = self._now = 0.0
        self._store = store
        self._pacing = pacing
        logged = message_takers(FlightLogBuilder(scenario), scenario.config)
        self._types = {topic.name: topic.type for topic in pacing.readable if topic.name in logged}
        self._recent: deque[tuple[str, bytes]] = deque(maxlen=RECENT_STEPS * len(self._types))
        for topic in self._types:
            pacing.read(topic, decode=_Serialized, raw=True)

    async def run(self) -> None:
        """Watch the flight to its end.

        Raises:
            StopRequestedError: by a signal.
        """
        async for step in self._pacing.steps():
            self._now = time.perf_counter()
            if step == 0:
                self._began = self._now
            for topic, messages in (await self._pacing.gather(step)).messages.items():
                for message in messages:
                    self._keep(topic, message.data)
            self.step = step
            self._on_step(self)
            self._pacing.done(step)
        self._now = time.perf_counter()

    @property
    def flown(self) -> float:
        """Simulation time that was flown [s]."""
        return max(0, self.step) * self._scenario.config.period_ns / NANOSECONDS_PER_SECOND

    @property
    def wall_time(self) -> float:
        """Wall time since the first tick [s]."""
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
        events = [
            deserialize_message(data, self._types[EVENTS]) for topic, data in self._recent if topic == EVENTS
        ]
        return next((event.description for event in reversed(events) if event.kind == EventKind.STEP), "")

    def log(self) -> FlightLog:
        """The flight so far."""
        return self._decode(self._store)

    def _decode(self, messages: Iterable[tuple[str, bytes]]) -> FlightLog:
        builder = FlightLogBuilder(self._scenario)
        takers = message_takers(builder, self._scenario.config)
        for topic, data in messages:
            takers[topic](deserialize_message(data, self._types[topic]))
        return builder.build()

    def _keep(self, topic: str, data: bytes) -> None:
        self._store.add(topic, data)
        self._recent.append((topic, data))
        if topic == SOLVER:
            status = deserialize_message(data, self._types[topic]).status
            self.fallbacks += status == SolverState.FALLBACK


@dataclass(frozen=True)
class _Serialized:
    """A message as it was serialized."""

    data: bytes

    @property
    def stamp_ns(self) -> int:
        return raw_stamp_ns(self.data)


@contextmanager
def monitoring(
    scenario: LoadedScenario,
    observers: Sequence[str],
    store: MessageStore,
    on_step: Callable[[Monitor], None],
    watch: Callable[[], None],
) -> Iterator[tuple[Monitor, Spinner]]:
    """A monitor in this process, while the block runs, and what runs it; calls ``watch`` while it waits."""
    rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)
    try:
        node = rclpy.create_node(split_node_name(MONITOR_NODE)[1], enable_rosout=False)
        spinner = Spinner(node, watch=watch)
        pacing = LockstepPacing(node, spinner, scenario, Roster.of(scenario.config, observers))
        yield Monitor(scenario, pacing, store, on_step), spinner
    finally:
        try_shutdown()
