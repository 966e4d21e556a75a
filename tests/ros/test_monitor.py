"""The monitor of a flight: flat memory, counted fallbacks, and a log that is complete."""

import tracemalloc
from collections.abc import AsyncIterator, Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from rclpy.serialization import serialize_message

from relform_analysis.flight.log import FlightLog
from relform_bringup.message_store import BLOCK_BYTES, MessageStore
from relform_bringup.nodes.monitor import Monitor, MonitorNode, logged_topics
from relform_core.names import GROUND_TRUTH, MONITOR_NODE, SOLVER, SolverState, vehicle_topic
from relform_core.roster import Roster
from relform_msgs.msg import SolverStatus
from relform_ros.fields import header_to_msg
from relform_ros.odometry import odometry_to_msg
from relform_ros.pacing import Gathered, Stamped
from relform_ros.topics import Topic, topic_table
from support.logs import odometry
from support.ros_nodes import run_without_waiting
from support.scenarios import paper_scenario

SCENARIO = paper_scenario()
CONFIG = SCENARIO.config
VEHICLES = CONFIG.team.vehicles


class MadeUpPacing:
    """Steps without other nodes: ground truth and a solver's report in each, every tenth a fallback."""

    def __init__(self, n_steps: int) -> None:
        topics = topic_table(CONFIG, Roster.of(CONFIG, [MONITOR_NODE])).values()
        self.readable: tuple[Topic, ...] = tuple(topic for topic in topics if MONITOR_NODE in topic.readers)
        self._n_steps = n_steps
        self._decoders: dict[str, Callable[[Any], Stamped]] = {}

    def read(
        self,
        topic: str,
        decode: Callable[[Any], Stamped],
        raw: bool = False,
        decode_data: Callable[[bytes], Stamped] | None = None,
    ) -> None:
        assert raw
        self._decoders[topic] = decode

    def watch(self, topic: str, take: Callable[[bytes, int], None]) -> None:
        raise AssertionError("the monitor reads")

    async def steps(self) -> AsyncIterator[int]:
        for step in range(self._n_steps):
            yield step

    async def gather(self, step: int, topics: Iterable[str] | None = None) -> Gathered:
        stamp_ns = step * CONFIG.period_ns
        messages: dict[str, Any] = {
            vehicle_topic(vehicle, GROUND_TRUTH): odometry_to_msg(
                odometry(stamp_ns, (float(index), 0.0, 2.0), 0.0), vehicle
            )
            for index, vehicle in enumerate(VEHICLES)
        }
        status = SolverState.FALLBACK if step % 10 == 9 else SolverState.SOLVED
        messages[SOLVER] = SolverStatus(header=header_to_msg(stamp_ns), step=step, status=status)
        return Gathered(
            {topic: (self._decoders[topic](serialize_message(each)),) for topic, each in messages.items()},
            faulty=False,
        )

    def publish(self, topic: str, message: Any, content: Stamped | None = None) -> None:
        raise AssertionError("the monitor publishes nothing")

    def done(
        self,
        step: int,
        fault: str = "",
        promised: Iterable[str] = (),
        report: Callable[[], Mapping[str, object]] = dict,
    ) -> None:
        assert not fault

    async def leave(self) -> None:
        raise AssertionError("the monitor sees the last step")


def watch(n_steps: int, folder: Path) -> tuple[Monitor, FlightLog, int]:
    """The monitor and the log of a flight, and the most memory that watching it took [bytes]."""
    topics = logged_topics(SCENARIO, [MONITOR_NODE])
    with MessageStore(folder) as store:
        monitor = Monitor(SCENARIO, topics, store, lambda flight: None)
        node = MonitorNode(MadeUpPacing(n_steps), topics, monitor.take)
        tracemalloc.start()
        try:
            run_without_waiting(node.run())
            _, peak = tracemalloc.get_traced_memory()
        finally:
            tracemalloc.stop()
        return monitor, monitor.log(), peak


def test_memory_does_not_grow_with_the_length_of_a_flight(tmp_path: Path) -> None:
    watch(10, tmp_path)  # imports the messages
    _, _, short_peak = watch(500, tmp_path)
    _, _, long_peak = watch(3000, tmp_path)  # has messages of 8 MB
    assert long_peak - short_peak < BLOCK_BYTES


def test_log_is_complete_and_fallbacks_are_counted(tmp_path: Path) -> None:
    monitor, log, _ = watch(25, tmp_path)
    assert (monitor.step, monitor.fallbacks) == (24, 2)
    np.testing.assert_array_equal(log.tick_ns, np.arange(25) * CONFIG.period_ns)
    np.testing.assert_array_equal(log.p_NB_N[-1, :, 0], range(len(VEHICLES)))


def test_what_no_log_needs_is_left_out(tmp_path: Path) -> None:
    with MessageStore(tmp_path) as store:
        monitor = Monitor(SCENARIO, logged_topics(SCENARIO, [MONITOR_NODE]), store, lambda flight: None)
        monitor.take([(vehicle_topic("leader", "imu"), b"of a recorder")])
        assert (monitor.step, list(store)) == (0, [])
