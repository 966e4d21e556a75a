"""Messages as text: YAML and comma-separated values, as ros2cli prints them."""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from itertools import islice
from typing import Any

from rosidl_parser.definition import (
    AbstractNestedType,
    AbstractType,
    AbstractWString,
    Array,
    BasicType,
    BoundedSequence,
    NamespacedType,
)

from relform_cli import yaml_text

ELLIPSIS = "..."


@dataclass(frozen=True)
class TextStyle:
    """What of a message to print, and how."""

    truncate_length: int | None = None
    """Number of items of an array and of characters of a string to print; None for all."""
    no_arr: bool = False
    """Print only the type and length of arrays."""
    no_str: bool = False
    """Print only the length of strings."""
    flow_style: bool = False
    """Print each array on one line."""


def is_message(value: object) -> bool:
    return hasattr(value, "SLOT_TYPES")


@cache
def field_types(message_type: Any) -> tuple[tuple[str, AbstractType], ...]:
    """Names and types of the fields of a class of messages, in the order of the definition."""
    return tuple(zip(message_type.get_fields_and_field_types(), message_type.SLOT_TYPES, strict=True))


def to_yaml(message: Any, style: TextStyle = TextStyle()) -> str:
    """YAML with one field a line."""
    plain = to_plain(message, style)
    return yaml_text.with_flow_lists(plain) if style.flow_style else yaml_text.block(plain)


def to_plain(message: Any, style: TextStyle = TextStyle()) -> dict[str, Any]:
    """The fields as dictionaries, lists, strings and numbers; bytes as characters of the same code."""
    plain = {}
    for name, type_ in field_types(message.__class__):
        value = getattr(message, name)
        if isinstance(type_, AbstractNestedType):
            plain[name] = _describe(value, type_) if style.no_arr else _plain_items(value, style)
        else:
            plain[name] = _plain_item(value, style)
    return plain


def _plain_items(values: Any, style: TextStyle) -> list[Any]:
    shown = values[: style.truncate_length]
    # Arrays of numbers convert themselves to lists.
    items = shown.tolist() if hasattr(shown, "tolist") else [_plain_item(value, style) for value in shown]
    return items if len(shown) == len(values) else [*items, ELLIPSIS]


def _plain_item(value: Any, style: TextStyle) -> Any:
    if is_message(value):
        return to_plain(value, style)
    if isinstance(value, bytes):
        return value.decode("latin-1")
    return _shorten(value, style) if isinstance(value, str) else value


def _shorten(text: str, style: TextStyle) -> str:
    if style.no_str:
        return f"<string length: <{len(text)}>>"
    shown = text[: style.truncate_length]
    return text if shown == text else shown + ELLIPSIS


def to_csv(message: Any, style: TextStyle = TextStyle()) -> str:
    """All values of all fields, separated by commas."""
    return ",".join(_csv_values(message, style))


def _csv_values(message: Any, style: TextStyle) -> Iterable[str]:
    for name, type_ in field_types(message.__class__):
        value = getattr(message, name)
        if not isinstance(type_, AbstractNestedType):
            yield _csv_item(value, style)
        elif style.no_arr:
            yield _describe(value, type_)
        else:
            yield _csv_array(value, style)


def _csv_array(values: Any, style: TextStyle) -> str:
    items = [_csv_item(value, style) for value in islice(values, style.truncate_length)]
    return ",".join(items if len(items) == len(values) else [*items, ELLIPSIS])


def _csv_item(value: Any, style: TextStyle) -> str:
    if is_message(value):
        return to_csv(value, style)
    return _shorten(value, style) if isinstance(value, str) else str(value)


def _describe(values: Any, type_: AbstractNestedType) -> str:
    name = _type_name(type_.value_type)
    if isinstance(type_, Array):
        return f"<array type: {name}[{type_.size}]>"
    bound = f"[{type_.maximum_size}]" if isinstance(type_, BoundedSequence) else ""
    return f"<sequence type: {name}{bound}, length: {len(values)}>"


def _type_name(type_: AbstractType) -> str:
    match type_:
        case BasicType():
            return str(type_.typename)
        case NamespacedType():
            return "/".join(type_.namespaced_name())
        case AbstractWString():
            return "wstring"
        case _:
            return "string"
