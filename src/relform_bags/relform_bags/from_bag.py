"""Messages of a bag as objects of the installed types, also those that an older version recorded.

A bag holds the definition of each of its types. If it differs from the installed one, a message is decoded
by the recorded definition, and its fields are taken over by name: a field that was not recorded has its
default.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import Any

from mcap.records import Schema
from mcap.well_known import MessageEncoding, SchemaEncoding
from mcap_ros2.decoder import DecoderFactory
from rclpy.serialization import serialize_message
from rosidl_parser.definition import (
    AbstractGenericString,
    AbstractNestedType,
    AbstractType,
    BasicType,
    NamespacedType,
)

from relform_bags.message_types import SEPARATOR, message_class, message_type
from relform_bags.reader import BagMessage
from relform_cli.message_text import field_types
from relform_core.errors import BagError
from relform_ros.raw import decoded


def decode(message: BagMessage) -> Any:
    """The message as an object of its installed type.

    Raises:
        BagError: the type is not installed, or the recorded definition cannot be read or contradicts it.
        RejectionError: the recorded bytes are no such message.
    """
    installed = message_class(message.type_name)
    if has_installed_definition(message):
        return decoded(message.data, installed)
    try:
        recorded = _decoder(message.type_name, message.definition)(message.data)
        return _taken_over(installed, recorded)
    except Exception as error:  # the library raises many kinds; all mean that the definition does not help
        raise BagError(
            f"message type '{message.type_name}' was recorded with another definition, which cannot be used: "
            f"{error}"
        ) from None


def as_installed(message: BagMessage) -> BagMessage:
    """The same message in the bytes of its installed definition.

    Raises:
        BagError: see ``decode``.
    """
    if has_installed_definition(message):
        return message
    return replace(message, data=serialize_message(decode(message)), definition="")


def has_installed_definition(message: BagMessage) -> bool:
    """Whether a message was recorded with the definition that is installed, or without any."""
    return not message.definition or _is_installed(message.type_name, message.definition)


@cache
def _is_installed(type_name: str, definition: str) -> bool:
    return _fields(definition) == _fields(message_type(type_name).definition)


def _fields(definition: str) -> dict[str, tuple[str, ...]]:
    """The lines of a definition that matter, without comments, by type; the first type has no name in it."""
    fields: dict[str, tuple[str, ...]] = {}
    for section in definition.split(SEPARATOR):
        lines = [" ".join(line.partition("#")[0].split()) for line in section.splitlines()]
        lines = [line for line in lines if line]
        is_named = bool(lines) and lines[0].startswith("MSG: ")
        fields[lines[0] if is_named else ""] = tuple(lines[1:] if is_named else lines)
    return fields


@cache
def _decoder(type_name: str, definition: str) -> Callable[[bytes], Any]:
    schema = Schema(id=1, name=type_name, encoding=SchemaEncoding.ROS2, data=definition.encode())
    decoder = DecoderFactory().decoder_for(MessageEncoding.CDR, schema)
    assert decoder is not None
    return decoder


def _taken_over(type_: Any, recorded: Any) -> Any:
    """A message of an installed type with the values of all fields that were recorded."""
    message = type_()
    for name, field in field_types(type_):
        if hasattr(recorded, name):
            value = getattr(recorded, name)
            if isinstance(field, BasicType) and not isinstance(value, type(getattr(message, name))):
                raise TypeError(f"{name} was {value!r}, which is no {field.typename}")
            setattr(message, name, _value(field, value))
    return message


def _value(field: AbstractType, recorded: Any) -> Any:
    match field:
        case AbstractNestedType():
            return [_value(field.value_type, each) for each in recorded]
        case NamespacedType():
            return _taken_over(message_class("/".join((*field.namespaces, field.name))), recorded)
        case AbstractGenericString():
            return str(recorded)
    return recorded
