"""A bag that a node fills: what recorders have in common."""

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
from relform_ros.run_node import Spinner

FLUSH_EVERY_S = 0.5
"""Wall time; a recorder that is killed loses no more than that."""
QUIET_S = 0.1
"""Nothing more is expected when nothing has arrived for so long."""
DRAIN_MAX_S = 1.0


class Recording:
    """Writes what arrives, and sees to it that chunks are finished and the bag is closed well."""

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
        self.failure: BagError | None = None
        """Why no more can be written; it must not be raised in a callback."""
        self._node = node
        self._spinner = spinner
        self._writer = BagWriter(Path(options.output), attachments, options.limits)
        self._topics: set[str] = set()
        node.create_timer(FLUSH_EVERY_S, self._flush, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def add_topic(self, name: str, type_name: str) -> None:
        """Declare a topic with what its publishers offer; does nothing if it was declared before.

        Raises:
            BagError: its type is not installed.
        """
        if name not in self._topics:
            offers = [info.qos_profile for info in self._node.get_publishers_info_by_topic(name)]
            self._writer.add_topic(name, type_name, [offered_qos(offer) for offer in offers])
            self._topics.add(name)

    def write(self, topic: str, data: bytes, log_time_ns: int, publish_time_ns: int) -> None:
        """Write a message; does nothing after a failure."""
        if self.failure is None:
            try:
                self._writer.write(topic, data, log_time_ns, publish_time_ns)
            except BagError as error:
                self.failure = error
        self.message_count += 1

    def close(self) -> None:
        """Write what is still arriving, then close the bag.

        Raises:
            BagError: see ``BagWriter``.
        """
        for _ in range(round(DRAIN_MAX_S / QUIET_S)):
            count = self.message_count
            self._spinner.drain(QUIET_S)
            if self.message_count == count:
                break
        self._writer.close()

    def _flush(self) -> None:
        if self.failure is None:
            try:
                self._writer.flush()
            except BagError as error:
                self.failure = error


def offered_qos(profile: QoSProfile) -> OfferedQos:
    """What a publisher offers, in the words of rosbag2."""
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
