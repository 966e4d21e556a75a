"""The bag that a recorder node is filling."""

import time
from collections.abc import Mapping
from pathlib import Path

from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.qos import QoSProfile

from relform_bags.metadata import OfferedQos, QosDuration
from relform_bags.options import RecorderOptions
from relform_bags.writer import BagWriter
from relform_core.errors import BagError, ConfigError
from relform_core.units import NANOSECONDS_PER_SECOND
from relform_ros.spinner import Spinner

FLUSH_EVERY_S = 0.5
"""Wall time; the most that a kill of the recorder can lose."""
QUIET_S = 0.1
"""After this time without a message, no further one is expected."""
DRAIN_MAX_S = 1.0


class OpenBag:
    """Takes the messages that a node receives, and finishes a chunk at least every ``FLUSH_EVERY_S``."""

    def __init__(
        self, node: Node, spinner: Spinner, options: RecorderOptions, attachments: Mapping[str, str]
    ) -> None:
        """Create the bag.

        Raises:
            ConfigError: the option ``output`` is not set.
            BagError: see ``BagWriter``.
        """
        if not options.output:
            raise ConfigError(
                "parameter output is not set: add --ros-args -p output:=<folder of the new bag>"
            )
        self.message_count = 0
        self.is_full = False
        """Whether the disk is full; ``close`` raises the error, which must not be raised in a callback."""
        self._node = node
        self._spinner = spinner
        self._writer = BagWriter(Path(options.output), attachments, options.limits)
        self._topics: set[str] = set()
        self._is_closed = False
        node.create_timer(FLUSH_EVERY_S, self._flush, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def add_topic(self, name: str, type_name: str) -> None:
        """Declare a topic with the quality of service of its publishers; does nothing the second time.

        Raises:
            BagError: its type is not installed.
        """
        if name not in self._topics:
            offers = [info.qos_profile for info in self._node.get_publishers_info_by_topic(name)]
            self._writer.add_topic(name, type_name, [offered_qos(offer) for offer in offers])
            self._topics.add(name)

    def write(self, topic: str, data: bytes, log_time_ns: int, publish_time_ns: int) -> None:
        """Write a message; on a full disk it goes into the reserve of the writer, while that has room."""
        if self._is_closed:
            return
        try:
            self._writer.write(topic, data, log_time_ns, publish_time_ns)
        except BagError:
            self.is_full = True
        self.message_count += 1

    def close(self) -> None:
        """Take messages until no more arrive, unless the disk is full, and close the bag if it is open.

        Raises:
            BagError: see ``BagWriter``.
        """
        if self._is_closed:
            return
        deadline, count = time.monotonic() + DRAIN_MAX_S, -1
        while not self.is_full and self.message_count > count and time.monotonic() < deadline:
            count = self.message_count
            self._spinner.drain(QUIET_S)
        self._is_closed = True
        self._writer.close()

    def _flush(self) -> None:
        try:
            self._writer.flush()
        except BagError:
            self.is_full = True


def offered_qos(profile: QoSProfile) -> OfferedQos:
    """The quality of service of a publisher, in the words of rosbag2."""
    return OfferedQos(
        history=profile.history.name.lower(),
        depth=profile.depth,
        reliability=profile.reliability.name.lower(),
        durability=profile.durability.name.lower(),
        deadline=_duration(profile.deadline),
        lifespan=_duration(profile.lifespan),
        liveliness=profile.liveliness.name.lower(),
        liveliness_lease_duration=_duration(profile.liveliness_lease_duration),
        avoid_ros_namespace_conventions=profile.avoid_ros_namespace_conventions,
    )


def _duration(duration: Duration) -> QosDuration:
    return QosDuration(*divmod(duration.nanoseconds, NANOSECONDS_PER_SECOND))
