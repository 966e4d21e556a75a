"""Subscriptions that take messages as they come over the wire, without decoding them."""

import inspect
from collections.abc import Callable
from typing import Any

from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.subscription import Subscription


def subscribe_raw(
    node: Node, type_: type[Any], topic: str, callback: Callable[[bytes, int], None], qos: QoSProfile
) -> Subscription:
    """Read the serialized messages of a topic.

    Args:
        callback: takes the message and the wall time at which it was published [ns].
    """

    def take(*arguments: Any) -> None:
        # Executors hand over message and info as two arguments, the EventsExecutor of Jazzy as one tuple.
        data, info = arguments if len(arguments) == 2 else arguments[0]
        callback(data, info["source_timestamp"])

    # By its signature rclpy sees that a callback wants the info.
    take.__signature__ = inspect.signature(lambda data, info: None)  # type: ignore[attr-defined]  # any object may have one
    return node.create_subscription(type_, topic, take, qos, raw=True)
