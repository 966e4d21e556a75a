"""Messages to text and back, for every kind of field of a message."""

from collections.abc import Callable
from importlib import import_module
from typing import Any

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st
from rosidl_parser.definition import (
    AbstractGenericString,
    AbstractNestedType,
    Array,
    BasicType,
    BoundedSequence,
    NamespacedType,
)

from relform_cli.errors import CommandError
from relform_cli.interfaces import interfaces, message_class
from relform_cli.message_fields import message_from_yaml
from relform_cli.message_text import TextStyle, field_types, is_message, to_csv, to_plain, to_yaml

PACKAGES = ("test_msgs", "relform_msgs", "sensor_msgs", "visualization_msgs", "rcl_interfaces", "std_msgs")
TYPES = [message_class(f"{package}/{name}") for package in PACKAGES for name in interfaces(package, "msg")]

# PyYAML writes these line ends such that it reads other ones.
TEXTS = st.text(st.characters(codec="utf-8", exclude_characters="\r\x85\u2028\u2029\ufeff"), max_size=12)


def values(type_: Any) -> st.SearchStrategy[Any]:
    match type_:
        case Array():
            return st.lists(values(type_.value_type), min_size=type_.size, max_size=type_.size)
        case BoundedSequence():
            return st.lists(values(type_.value_type), max_size=min(type_.maximum_size, 3))
        case AbstractNestedType():
            return st.lists(values(type_.value_type), max_size=3)
        case NamespacedType():
            return messages(getattr(import_module(".".join(type_.namespaces)), type_.name))
        case AbstractGenericString():
            longest = type_.maximum_size if type_.has_maximum_size() else 12
            return TEXTS.map(lambda text: text[:longest])
        case BasicType(typename="boolean"):
            return st.booleans()
        case BasicType(typename="octet"):
            return st.integers(0, 127).map(lambda value: bytes([value]))
        case BasicType(typename="float"):
            return st.floats(width=32)
        case BasicType(typename="double"):
            return st.floats()
    bits = int(type_.typename.lstrip("uint"))
    lowest = 0 if type_.typename.startswith("u") else -(2 ** (bits - 1))
    return st.integers(lowest, lowest + 2**bits - 1)


def messages(message_type: Callable[..., Any]) -> st.SearchStrategy[Any]:
    fields = {name: values(type_) for name, type_ in field_types(message_type)}
    return st.builds(message_type, **fields)


def equal(one: Any, other: Any) -> bool:
    if is_message(one):
        names = [name for name, _ in field_types(type(one))]
        return type(one) is type(other) and all(equal(getattr(one, n), getattr(other, n)) for n in names)
    if isinstance(one, str | bytes) or not hasattr(one, "__len__"):
        return bool(one == other or (one != one and other != other))  # the same, or both not numbers
    return type(one) is type(other) and len(one) == len(other) and all(map(equal, one, other))


def test_types_have_all_kinds_of_fields() -> None:
    kinds = {type(type_).__name__ for message_type in TYPES for _, type_ in field_types(message_type)}
    items = {
        type(type_.value_type).__name__
        for message_type in TYPES
        for _, type_ in field_types(message_type)
        if isinstance(type_, AbstractNestedType)
    }
    assert kinds == {
        *("BasicType", "NamespacedType", "BoundedString", "UnboundedString", "UnboundedWString"),
        *("Array", "BoundedSequence", "UnboundedSequence"),
    }
    assert items == {"BasicType", "NamespacedType", "UnboundedString", "UnboundedWString"}


@given(st.data())
@settings(max_examples=300)
def test_yaml_is_read_back_as_the_same_message(data: st.DataObject) -> None:
    message = data.draw(st.sampled_from(TYPES).flatmap(messages))
    text = to_yaml(message)
    assert repr(yaml.safe_load(text)) == repr(to_plain(message))
    again, times = message_from_yaml(type(message), text)
    assert equal(message, again)
    assert times == []
    assert repr(yaml.safe_load(to_yaml(message, TextStyle(flow_style=True)))) == repr(to_plain(message))


@pytest.mark.parametrize(
    ("type_name", "text", "csv"),
    [
        ("std_msgs/msg/Header", "{stamp: {sec: 7, nanosec: 30}, frame_id: world}", "7,30,world"),
        ("visualization_msgs/msg/MenuEntry", "{id: 3, title: a b}", "3,0,a b,,0"),
        ("std_msgs/msg/Float32MultiArray", "data: [0.5, -1.0e+20]", ",0,0.5,-1.0000000200408773e+20"),
        ("std_msgs/msg/ByteMultiArray", "data: [1, 255]", ",0,b'\\x01',b'\\xff'"),
    ],
)
def test_csv_keeps_the_comma_of_an_empty_first_value(type_name: str, text: str, csv: str) -> None:
    message, _ = message_from_yaml(message_class(type_name), text)
    assert to_csv(message) == csv


def test_styles() -> None:
    message = message_class("test_msgs/msg/UnboundedSequences")()
    message.float32_values = [0.5, 1e20, 3.0]
    message.string_values = ["kilometre", ""]
    message.byte_values = [b"a", b"\xff"]

    def lines(style: TextStyle) -> list[str]:
        return to_yaml(message, style).splitlines()

    short = TextStyle(truncate_length=2)
    assert lines(short)[lines(short).index("float32_values:") :][:4] == [
        *("float32_values:", "- 0.5", "- 1.0000000200408773e+20", "- '...'")
    ]
    assert "- ki..." in lines(short)
    assert "- ÿ" in lines(short)
    bare = TextStyle(no_arr=True, no_str=True)
    assert "float32_values: '<sequence type: float, length: 3>'" in lines(bare)
    assert "basic_types_values: '<sequence type: test_msgs/msg/BasicTypes, length: 0>'" in lines(bare)
    bounded = message_class("test_msgs/msg/BoundedSequences")()
    assert "int8_values: '<sequence type: int8[3], length: 0>'" in to_yaml(bounded, bare).splitlines()
    fixed = message_class("test_msgs/msg/Arrays")()
    assert "string_values: '<array type: string[3]>'" in to_yaml(fixed, bare).splitlines()
    text = message_class("std_msgs/msg/String")(data="kilometre")
    assert to_yaml(text, bare) == "data: '<string length: <9>>'\n"
    assert to_csv(text, short) == "ki..."
    assert to_yaml(message_class("std_msgs/msg/Empty")()) == "{}\n"


def test_fields_that_are_not_given_keep_their_defaults() -> None:
    message, _ = message_from_yaml(message_class("test_msgs/msg/Defaults"), "{int8_value: -7}")
    assert (message.int8_value, message.int16_value, message.bool_value) == (-7, -1000, True)


def test_times_of_sending() -> None:
    pose, times = message_from_yaml(message_class("geometry_msgs/msg/PoseStamped"), "header: auto")
    assert times == [pose.header.stamp]
    times[0].sec = 7
    assert pose.header.stamp.sec == 7
    text = "markers: [{header: {stamp: now, frame_id: world}}, {header: auto}]"
    markers, times = message_from_yaml(message_class("visualization_msgs/msg/MarkerArray"), text)
    assert [time is marker.header.stamp for time, marker in zip(times, markers.markers, strict=True)] == [
        True
    ] * 2
    assert markers.markers[0].header.frame_id == "world"


@pytest.mark.parametrize(
    ("type_name", "text", "field", "value"),
    [
        ("std_msgs/msg/String", "data: 5", "data", "5"),
        ("std_msgs/msg/Float64", "data: 1e3", "data", 1000.0),  # for YAML 1.1 a string
        ("std_msgs/msg/Float64", "data: 7", "data", 7.0),
        ("std_msgs/msg/Int8", "data: 5.0", "data", 5),
        ("std_msgs/msg/Byte", "data: 255", "data", b"\xff"),
        ("std_msgs/msg/Byte", "data: a", "data", b"a"),
        ("std_msgs/msg/Bool", "data: 1", "data", True),
        ("std_msgs/msg/UInt8MultiArray", "data: !!binary AAH/", "data", [0, 1, 255]),
    ],
)
def test_accepts_values_that_convert(type_name: str, text: str, field: str, value: Any) -> None:
    message, _ = message_from_yaml(message_class(type_name), text)
    found = getattr(message, field)
    assert (list(found) if isinstance(value, list) else found) == value


@pytest.mark.parametrize(
    ("type_name", "text", "reason"),
    [
        ("std_msgs/msg/Int8", "data: 300", "data: 300 is not an integer from -128 to 127"),
        ("std_msgs/msg/Int8", "data: 1.5", "data: 1.5 is not an integer"),
        ("std_msgs/msg/UInt8", "data: -1", "data: -1 is not an integer from 0 to 255"),
        ("std_msgs/msg/Byte", "data: ab", "data: 'ab' is not a byte"),
        ("std_msgs/msg/Byte", "data: 256", "data: 256 is not a byte"),
        ("std_msgs/msg/Bool", "data: 'false'", "data: 'false' is not true or false"),
        ("std_msgs/msg/Bool", "data: [1]", "data: [1] is not true or false"),
        ("std_msgs/msg/Float32", "data: 1.0e+39", "data: 1e+39 is not a number from -3.40282e+38"),
        ("std_msgs/msg/Float64", "data: far", "data: 'far' is not a number"),
        ("std_msgs/msg/Float64", "data:", "data: None is not a number"),
        ("std_msgs/msg/String", "data:", "data: None is not a string"),
        ("std_msgs/msg/String", "data: {a: 1}", "data: {'a': 1} is not a string; quote it if it is"),
        ("std_msgs/msg/String", "dta: hi", "std_msgs/String has no field 'dta'; its fields: data"),
        ("std_msgs/msg/Empty", "dta: hi", "std_msgs/Empty has no field 'dta'; its fields: none"),
        ("sensor_msgs/msg/Imu", "orientation: 5", "orientation: 5 is not a dictionary of the fields of"),
        ("sensor_msgs/msg/Imu", "orientation: {x: a}", "orientation.x: 'a' is not a number"),
        (
            "sensor_msgs/msg/Imu",
            "orientation_covariance: [1]",
            "orientation_covariance has 1 items, it must have 9",
        ),
        ("sensor_msgs/msg/Imu", "orientation_covariance: 1", "orientation_covariance: 1 is not a list"),
        (
            "test_msgs/msg/BoundedSequences",
            "int8_values: [1, 2, 3, 4]",
            "int8_values has 4 items, it may have 3 at",
        ),
        (
            "test_msgs/msg/Strings",
            f"bounded_string_value: {'a' * 23}",
            "has 23 characters, it may have 22 at most",
        ),
        (
            "test_msgs/msg/Arrays",
            "basic_types_values: [{}, {int8_value: x}, {}]",
            "basic_types_values[1].int8_value:",
        ),
    ],
)
def test_reports_values_that_do_not_fit(type_name: str, text: str, reason: str) -> None:
    with pytest.raises(CommandError) as caught:
        message_from_yaml(message_class(type_name), text)
    assert str(caught.value).startswith("Failed to populate field: ")
    assert reason in str(caught.value)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "{data: 1",
            "The passed value is not YAML: expected ',' or '}', but got '<stream end>' at line 1, column 9",
        ),
        ("a: b: c", "The passed value is not YAML: mapping values are not allowed here at line 1, column 5"),
        ("data: \x00", "The passed value is not YAML: cannot be read"),
        ("[1]", "The passed value needs to be a dictionary in YAML format"),
        ("", "The passed value needs to be a dictionary in YAML format"),
    ],
)
def test_reports_text_that_is_not_yaml(text: str, message: str) -> None:
    with pytest.raises(CommandError) as caught:
        message_from_yaml(message_class("std_msgs/msg/Int8"), text)
    assert str(caught.value) == message
