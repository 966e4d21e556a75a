"""Messages as a subscription receives them, and values for comparison bit by bit."""

import array
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
        case tuple() | list():
            return [bits(each) for each in value]
        case array.array():
            return value.typecode, value.tobytes()
        case _ if hasattr(value, "get_fields_and_field_types"):  # a message
            return [bits(getattr(value, name)) for name in value.get_fields_and_field_types()]
        case _ if is_dataclass(value):
            return type(value), [(field.name, bits(getattr(value, field.name))) for field in fields(value)]
        case _:
            return type(value), value
