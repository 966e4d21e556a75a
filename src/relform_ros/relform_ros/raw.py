"""Subscriptions that take serialized messages without decoding them."""

import inspect
import struct
from collections.abc import Callable
from typing import Any

from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.subscription import Subscription

from relform_core.units import NANOSECONDS_PER_SECOND

_STAMP = struct.Struct("<iI")
_STAMP_OFFSET = 4
"""After the bytes that name the encoding, which is little endian."""


def raw_stamp_ns(data: bytes) -> int:
    """Stamp of a serialized message that begins with a header or a time, as all of a flight do [ns]."""
    seconds, nanoseconds = _STAMP.unpack_from(data, _STAMP_OFFSET)
    return int(seconds * NANOSECONDS_PER_SECOND + nanoseconds)


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

    # The signature tells rclpy that this callback takes the info.
    take.__signature__ = inspect.signature(lambda data, info: None)  # type: ignore[attr-defined]  # any object may have one
    return node.create_subscription(type_, topic, take, qos, raw=True)
