"""Subscriptions that take serialized messages without decoding them."""

import inspect
import struct
from collections.abc import Callable
from typing import Any, TypeVar

from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.serialization import deserialize_message
from rclpy.subscription import Subscription

from relform_core.units import NANOSECONDS_PER_SECOND
from relform_ros.rejection import Reason, RejectionError

M = TypeVar("M")

_STAMP = struct.Struct("<iI")
_STAMP_OFFSET = 4
"""After the bytes that name the encoding, which is little endian."""


def raw_stamp_ns(data: bytes) -> int:
    """Stamp of a serialized message that begins with a header or a time, as all of a flight do [ns].

    Raises:
        RejectionError: the message is too short, or its stamp is not valid.
    """
    if len(data) < _STAMP_OFFSET + _STAMP.size:
        raise RejectionError(Reason.INVALID, f"{len(data)} bytes are no message with a stamp")
    seconds, nanoseconds = _STAMP.unpack_from(data, _STAMP_OFFSET)
    if seconds < 0 or nanoseconds >= NANOSECONDS_PER_SECOND:
        raise RejectionError(Reason.INVALID, f"{seconds} s + {nanoseconds} ns is no valid stamp")
    return int(seconds * NANOSECONDS_PER_SECOND + nanoseconds)


def decoded(data: bytes, type_: type[M]) -> M:
    """A serialized message as an object of its type.

    Raises:
        RejectionError: the bytes are no message of this type.
    """
    try:
        message: M = deserialize_message(data, type_)
    except rclpy_implementation.RMWError:
        raise RejectionError(
            Reason.INVALID, f"{len(data)} bytes cannot be decoded as {type_.__name__}"
        ) from None
    return message


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
