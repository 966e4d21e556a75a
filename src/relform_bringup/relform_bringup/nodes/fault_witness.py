"""A node of the fault campaign beside a flight: hears its clock, and may send messages on its topics."""

import time
from collections.abc import Callable
from functools import partial
from itertools import cycle
from types import TracebackType
from typing import Any, Self

import rclpy
from geometry_msgs.msg import TwistWithCovarianceStamped
from nav_msgs.msg import Odometry
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.publisher import Publisher
from rclpy.serialization import deserialize_message, serialize_message
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Imu, Range

from relform_core.load import LoadedScenario
from relform_core.names import CLOCK, RECORDER_NODE
from relform_core.roster import Roster
from relform_core.units import NANOSECONDS_PER_SECOND
from relform_msgs.msg import RangeBearingArray, RotorSpeeds
from relform_ros.fields import stamp_from_msg, stamp_to_msg
from relform_ros.qos import LOCKSTEP
from relform_ros.topics import topic_table

OFF_NS = (0, -1_000_000_000, 2_000_000_000)
"""How far the stamps of foreign messages are off, in turn [ns]."""


class Witness:
    """Hears the clock of a flight in one domain; a context manager."""

    def __init__(self, domain_id: int, scenario: LoadedScenario) -> None:
        self._context = Context()
        rclpy.init(context=self._context, domain_id=domain_id)
        self._node = rclpy.create_node("witness", namespace="faults", context=self._context)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)
        self._topics = topic_table(scenario.config, Roster.of(scenario.config, [RECORDER_NODE]))
        self._disturbs_until = 0.0
        self._sent: set[bytes] = set()
        self._off_ns = cycle(OFF_NS)
        self.now = -1.0
        """Instant of the flight by its newest tick [s]; negative: it has not begun."""
        self._node.create_subscription(Clock, CLOCK, self._on_clock, LOCKSTEP)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._executor.shutdown()
        self._node.destroy_node()
        self._context.try_shutdown()

    def wait(self, condition: Callable[[], bool], timeout: float) -> bool:
        """Wait until a condition holds; returns whether it does within a time [s]."""
        deadline = time.monotonic() + timeout
        while not condition():
            if time.monotonic() > deadline:
                return False
            self._executor.spin_once(timeout_sec=0.02)
        return True

    def disturb(self, vehicle: str, duration: float, copies: int) -> None:
        """Send messages on the topics of a vehicle for a time [s]: copies of each that is heard, altered.

        Frames and sizes are right, but the content is not that of the flight, and two of three stamps are
        not, either.
        """
        self._disturbs_until = time.monotonic() + duration
        for topic in self._topics.values():
            if topic.name.startswith(f"/{vehicle}/") and topic.type in _ALTER:
                publisher = self._node.create_publisher(topic.type, topic.name, topic.qos)
                respond = partial(self._respond, topic.type, publisher, copies)
                self._node.create_subscription(topic.type, topic.name, respond, topic.qos, raw=True)

    def _respond(self, type_: type, publisher: Publisher, copies: int, heard: bytes) -> None:
        if heard in self._sent or time.monotonic() > self._disturbs_until:
            return  # this node hears itself, too
        message = deserialize_message(heard, type_)
        stamp_ns = stamp_from_msg(message.header.stamp)
        _ALTER[type_](message)
        for _ in range(copies):
            copy_ns = max(0, stamp_ns + next(self._off_ns))
            message.header.stamp = stamp_to_msg(copy_ns)
            data = serialize_message(message)
            self._sent.add(data)
            publisher.publish(data)

    def _on_clock(self, message: Clock) -> None:
        self.now = stamp_from_msg(message.clock) / NANOSECONDS_PER_SECOND


def _alter_imu(message: Imu) -> None:
    message.angular_velocity.x += 0.7


def _alter_flow(message: TwistWithCovarianceStamped) -> None:
    message.twist.twist.linear.x += 0.5


def _alter_sonar(message: Range) -> None:
    message.range += 0.4


def _alter_pose(message: Odometry) -> None:
    message.pose.pose.position.y += 1.5


def _alter_sights(message: RangeBearingArray) -> None:
    for sight in message.observations:
        sight.range += 0.6


def _alter_command(message: RotorSpeeds) -> None:
    message.speeds = [0.5 * speed for speed in message.speeds]


_ALTER: dict[type, Callable[[Any], None]] = {
    Imu: _alter_imu,
    TwistWithCovarianceStamped: _alter_flow,
    Range: _alter_sonar,
    Odometry: _alter_pose,
    RangeBearingArray: _alter_sights,
    RotorSpeeds: _alter_command,
}
"""What makes the content of a message another one that is possible, by its type."""
