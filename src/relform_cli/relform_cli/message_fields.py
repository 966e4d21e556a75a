"""Messages from YAML, for `topic pub` and `service call`."""

import importlib
import math
from collections.abc import Callable
from typing import Any

import yaml
from rosidl_parser.definition import (
    AbstractGenericString,
    AbstractNestedType,
    AbstractType,
    Array,
    BasicType,
    BoundedSequence,
    NamespacedType,
)

from relform_cli.errors import CommandError, yaml_problem
from relform_cli.message_text import field_types

FLOAT32_MAX = (2.0 - 2.0**-23) * 2.0**127


def message_from_yaml(message_type: Any, text: str) -> tuple[Any, list[Any]]:
    """A message with the given fields, and those of its times that are to be the time of sending.

    The latter are fields of type builtin_interfaces/msg/Time with the value "now", and stamps of headers with
    the value "auto".

    Raises:
        CommandError: the text is not YAML, or a value does not fit into the message.
    """
    try:
        values = yaml.safe_load(text)
    except yaml.YAMLError as error:
        raise CommandError(f"The passed value is not YAML: {yaml_problem(error)}") from None
    if not isinstance(values, dict):
        raise CommandError("The passed value needs to be a dictionary in YAML format")
    filler = _Filler()
    return filler.message(message_type, values, ""), filler.times


class _Filler:
    """Converts values to the types of a message's fields. Each ``where`` is the dotted name of a field."""

    def __init__(self) -> None:
        self.times: list[Any] = []

    def message(self, message_type: Any, values: Any, where: str) -> Any:
        message = message_type()
        type_name = _type_name(message_type)
        if type_name == "builtin_interfaces/Time" and values == "now":
            self.times.append(message)
        elif type_name == "std_msgs/Header" and values == "auto":
            self.times.append(message.stamp)
        elif isinstance(values, dict):
            types = dict(field_types(message_type))
            for name, value in values.items():
                if name not in types:
                    known = ", ".join(types) or "none"
                    raise _failure(f"{type_name} has no field '{name}'; its fields: {known}")
                setattr(message, name, self.value(types[name], value, f"{where}.{name}" if where else name))
        else:
            raise _failure(f"{where}: {values!r} is not a dictionary of the fields of {type_name}")
        return message

    def value(self, type_: AbstractType, value: Any, where: str) -> Any:
        match type_:
            case AbstractNestedType():
                _check_length(type_, value, where)
                return [self.value(type_.value_type, item, f"{where}[{i}]") for i, item in enumerate(value)]
            case NamespacedType():
                module = importlib.import_module(".".join(type_.namespaces))
                return self.message(getattr(module, type_.name), value, where)
            case AbstractGenericString():
                return _string(type_, value, where)
            case BasicType():
                return _number(type_.typename, value, where)
        raise AssertionError(f"unknown type of rosidl: {type_}")


def _failure(reason: str) -> CommandError:
    return CommandError(f"Failed to populate field: {reason}")


def _type_name(message_type: Any) -> str:
    return f"{message_type.__module__.partition('.')[0]}/{message_type.__name__}"


def _check_length(type_: AbstractNestedType, values: Any, where: str) -> None:
    if not isinstance(values, list | bytes):
        raise _failure(f"{where}: {values!r} is not a list")
    if isinstance(type_, Array) and len(values) != type_.size:
        raise _failure(f"{where} has {len(values)} items, it must have {type_.size}")
    if isinstance(type_, BoundedSequence) and len(values) > type_.maximum_size:
        raise _failure(f"{where} has {len(values)} items, it may have {type_.maximum_size} at most")


def _string(type_: AbstractGenericString, value: Any, where: str) -> str:
    if value is None or isinstance(value, list | dict):
        raise _failure(f"{where}: {value!r} is not a string; quote it if it is")
    text = str(value)
    if type_.has_maximum_size() and len(text) > type_.maximum_size:
        raise _failure(f"{where} has {len(text)} characters, it may have {type_.maximum_size} at most")
    return text


def _number(kind: str, value: Any, where: str) -> Any:
    convert, description = _NUMBERS[kind]
    try:
        return convert(value)
    except (ValueError, TypeError, OverflowError):
        raise _failure(f"{where}: {value!r} is not {description}") from None


def _boolean(value: Any) -> bool:
    if value not in (False, True):  # 0 and 1 are equal to them
        raise ValueError
    return bool(value)


def _octet(value: Any) -> bytes:
    octets = value.encode("latin-1") if isinstance(value, str) else bytes([value])
    (_,) = octets
    return octets


def _float32(value: Any) -> float:
    number = float(value)
    if math.isfinite(number) and abs(number) > FLOAT32_MAX:
        raise ValueError
    return number


def _integer(lowest: int, highest: int) -> tuple[Callable[[Any], int], str]:
    def convert(value: Any) -> int:
        integer = int(value)
        if not lowest <= integer <= highest or (isinstance(value, float) and integer != value):
            raise ValueError
        return integer

    return convert, f"an integer from {lowest} to {highest}"


_NUMBERS: dict[str, tuple[Callable[[Any], Any], str]] = {
    "boolean": (_boolean, "true or false"),
    "octet": (_octet, "a byte: an integer from 0 to 255, or a character"),
    "float": (_float32, f"a number from {-FLOAT32_MAX:g} to {FLOAT32_MAX:g}"),
    "double": (float, "a number"),
    **{f"uint{bits}": _integer(0, 2**bits - 1) for bits in (8, 16, 32, 64)},
    **{f"int{bits}": _integer(-(2 ** (bits - 1)), 2 ** (bits - 1) - 1) for bits in (8, 16, 32, 64)},
}
