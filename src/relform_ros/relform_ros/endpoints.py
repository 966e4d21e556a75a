"""The publishers and subscriptions of one node, made from the table of topics."""

import time
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Mapping
from functools import partial
from typing import Any

from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import QoSCompatibility, QoSProfile, qos_check_compatible
from rclpy.serialization import serialize_message
from rclpy.subscription import Subscription
from rclpy.topic_endpoint_info import TopicEndpointInfo

from relform_core.names import CLOCK
from relform_ros.intra_process import IntraProcess
from relform_ros.raw import subscribe_raw
from relform_ros.rejection import RejectionError, Rejections
from relform_ros.topics import Topic


class Endpoints:
    """The topics that a node writes and reads."""

    def __init__(
        self, node: Node, topics: Mapping[str, Topic], intra_process: IntraProcess | None = None
    ) -> None:
        """``intra_process``: what the nodes of this process exchange; None: nothing."""
        self.rejections = Rejections()
        """Of the messages that were read."""
        self._node = node
        self._name = node.get_fully_qualified_name()
        self._topics = topics
        self._intra_process = intra_process or IntraProcess(())
        self._publishers: dict[str, Publisher] = {
            topic.name: node.create_publisher(topic.type, topic.name, topic.qos)
            for topic in topics.values()
            if self._name in topic.writers
        }
        self._subscriptions: dict[str, Subscription] = {}

    @property
    def readable(self) -> tuple[Topic, ...]:
        """The topics that this node reads by the table."""
        return tuple(topic for topic in self._topics.values() if self._name in topic.readers)

    def publish(self, topic: str, message: Any, content: Any = None) -> None:
        """Send a message on a topic that this node writes by the table; ``content``: see ``Pacing``."""
        data = serialize_message(message) if self._intra_process.wants_serialized(topic) else b""
        self._publishers[topic].publish(data or message)
        self._intra_process.publish(topic, message, data, content)

    def subscribe_raw(self, topic: str, callback: Callable[[bytes, int], None]) -> None:
        """Read a topic without decoding it.

        Args:
            callback: see ``raw.subscribe_raw``; a RejectionError that it raises is counted.
        """

        def take(data: bytes, publish_time_ns: int) -> None:
            try:
                callback(data, publish_time_ns)
            except RejectionError as rejected:
                self.rejections.count(topic, rejected)

        entry = self._topics[topic]
        if self._intra_process.exchanges(entry.writers):
            self._intra_process.subscribe_raw(topic, take)
        else:
            self._subscriptions[topic] = subscribe_raw(self._node, entry.type, topic, take, entry.qos)

    def subscribe(
        self,
        topic: str,
        callback: Callable[[Any], None],
        take_content: Callable[[Any], None] | None = None,
        take_data: Callable[[bytes], None] | None = None,
    ) -> None:
        """Read a topic.

        Args:
            callback: takes the message; a RejectionError that it raises is counted.
            take_content: takes the content of a message of this process instead, if the writer gives it.
            take_data: takes a message of another process instead, as it was serialized.
        """

        def take(message: Any, take_it: Callable[[Any], None] = callback) -> None:
            try:
                take_it(message)
            except RejectionError as rejected:
                self.rejections.count(topic, rejected)

        entry = self._topics[topic]
        if self._intra_process.exchanges(entry.writers):
            counted = None if take_content is None else partial(take, take_it=take_content)
            self._intra_process.subscribe(topic, take, counted)
        elif take_data is not None:
            self._subscriptions[topic] = subscribe_raw(
                self._node, entry.type, topic, lambda data, _: take(data, take_data), entry.qos
            )
        else:
            self._subscriptions[topic] = self._node.create_subscription(
                entry.type, topic, lambda message: take(message), entry.qos
            )

    def unmatched(self, among: Iterable[str] | None = None) -> set[str]:
        """Topics with writers or readers that this node has not discovered yet.

        Args:
            among: check only these topics; None: all that the node writes or reads.
        """
        topics = {*self._publishers, *self._subscriptions} if among is None else among
        return {
            topic
            for topic in topics
            if not (self._publisher_matched(topic) and self._subscription_matched(topic))
        }

    def partners(self, topic: str) -> set[str]:
        """The other nodes that write or read a topic."""
        entry = self._topics[topic]
        writers = entry.writers if topic in self._subscriptions else ()
        readers = self._readers_outside(topic) if topic in self._publishers else ()
        return {*writers, *readers} - {self._name}

    def absent(self, topic: str) -> set[str]:
        """The partners of a topic that are missing on it."""
        writers = self._node.get_publishers_info_by_topic(topic)
        readers = self._node.get_subscriptions_info_by_topic(topic)
        return self.partners(topic) - _full_names([*writers, *readers])

    def lacks_only(self, topic: str, nodes: Collection[str]) -> bool:
        """Whether some partners of a topic are missing on it, but only such of these nodes."""
        absent = self.absent(topic)
        return bool(absent) and absent <= set(nodes)

    def intruders(self) -> list[str]:
        """A line for each node that could be mistaken for one of this table: namesakes and other clocks."""
        writers = {
            topic: Counter(_full_name(info) for info in self._node.get_publishers_info_by_topic(topic))
            for topic in self._topics
        }
        namesakes = {
            name
            for topic, found in writers.items()
            for name, count in found.items()
            if count > 1 and name in self._topics[topic].writers
        }
        clocks = set(writers[CLOCK]) - set(self._topics[CLOCK].writers)
        return [
            *(f"more than one node is called {name}" for name in sorted(namesakes)),
            *(f"{name} publishes {CLOCK} as well" for name in sorted(clocks)),
        ]

    def wait_until_received(self, timeout_s: float) -> None:
        """Wait until the readers have received everything from this node, but not longer than the timeout."""
        deadline = time.monotonic() + timeout_s
        for publisher in self._publishers.values():
            publisher.wait_for_all_acked(Duration(seconds=max(0.0, deadline - time.monotonic())))

    # Counting is not enough, because strangers count as well (`ros2 topic echo`), and a node can be known
    # before it is connected. So all named nodes must be known, and all known nodes must be connected.

    def _publisher_matched(self, topic: str) -> bool:
        publisher = self._publishers.get(topic)
        if publisher is None:
            return True
        found = self._node.get_subscriptions_info_by_topic(topic)
        return self._readers_outside(topic) <= _full_names(found) and (
            publisher.get_subscription_count()
            >= sum(_compatible(publisher.qos_profile, info.qos_profile) for info in found)
        )

    def _readers_outside(self, topic: str) -> set[str]:
        """The readers of a topic that need a connection."""
        entry = self._topics[topic]
        inside = self._intra_process.nodes if self._intra_process.exchanges(entry.writers) else ()
        return set(entry.readers).difference(inside)

    def _subscription_matched(self, topic: str) -> bool:
        subscription = self._subscriptions.get(topic)
        if subscription is None:
            return True
        found = self._node.get_publishers_info_by_topic(topic)
        return set(self._topics[topic].writers) <= _full_names(found) and (
            subscription.get_publisher_count()
            >= sum(_compatible(info.qos_profile, subscription.qos_profile) for info in found)
        )


def _full_names(found: Iterable[TopicEndpointInfo]) -> set[str]:
    return {_full_name(info) for info in found}


def _full_name(info: TopicEndpointInfo) -> str:
    return f"{info.node_namespace.rstrip('/')}/{info.node_name}"


def _compatible(offered: QoSProfile, requested: QoSProfile) -> bool:
    compatibility, _ = qos_check_compatible(offered, requested)
    return bool(compatibility != QoSCompatibility.ERROR)
