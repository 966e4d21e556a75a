"""Messages as a subscription receives them, and values for comparison bit by bit."""

from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np
from rclpy.serialization import deserialize_message, serialize_message


def over_the_wire(message: Any) -> Any:
    """A message as a subscription receives it."""
    return deserialize_message(serialize_message(message), type(message))


def bits(value: Any) -> Any:
    """A value that is equal only if every bit is: -0.0 differs from 0.0, and shapes and types count."""
    match value:
        case np.ndarray():
            return value.dtype.str, value.shape, value.tobytes()
        case float():
            return value.hex()
        case dict():
            return [(key, bits(each)) for key, each in value.items()]
        case tuple():
            return [bits(each) for each in value]
        case _ if is_dataclass(value):
            return type(value), [(field.name, bits(getattr(value, field.name))) for field in fields(value)]
        case _:
            return type(value), value
