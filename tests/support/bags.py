"""Messages for bags, made by rosbags, which shares no code with the writer of relform."""

from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from ament_index_python.packages import get_package_share_directory
from rosbags.interfaces import Nodetype
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from relform_bags.metadata import OfferedQos
from relform_bags.split_limits import SplitLimits
from relform_bags.writer import BagWriter

LATCHED = OfferedQos(durability="transient_local")
TOPICS = {
    "/clock": ("rosgraph_msgs/msg/Clock", [OfferedQos()]),
    "/leader/ground_truth": ("nav_msgs/msg/Odometry", [OfferedQos()]),
    "/follower_1/rotor_speeds": ("relform_msgs/msg/RotorSpeeds", [OfferedQos()]),
    "/formation/events": ("relform_msgs/msg/FormationEvent", [LATCHED, LATCHED]),
    "/sim/step_done": ("relform_msgs/msg/StepDone", []),
}
"""Type and offered quality of service by topic."""


@cache
def typestore() -> Typestore:
    """The types of ROS 2 Jazzy and of relform, read by rosbags from the .msg files."""
    store = get_typestore(Stores.ROS2_JAZZY)
    for path in Path(get_package_share_directory("relform_msgs"), "msg").glob("*.msg"):
        store.register(get_types_from_msg(path.read_text(), f"relform_msgs/msg/{path.stem}"))
    return store


def random_message(type_name: str, generator: np.random.Generator) -> Any:
    """A message with random values in every field, and lists of random lengths."""
    store = typestore()
    fields = store.get_msgdef(type_name).fields
    values = {name: _random_value(field, generator) for name, field in fields}
    return store.types[type_name](**values)


def _random_value(field: Any, generator: np.random.Generator) -> Any:
    kind, detail = field
    if kind == Nodetype.NAME:
        return random_message(detail, generator)
    if kind == Nodetype.BASE:
        return _random_base(detail[0], generator)
    element, length = detail
    number = length if kind == Nodetype.ARRAY else int(generator.integers(0, 4))
    values = [_random_value(element, generator) for _ in range(number)]
    is_numeric = element[0] == Nodetype.BASE and element[1][0] != "string"
    return np.array(values, dtype=element[1][0]) if is_numeric else values


def _random_base(name: str, generator: np.random.Generator) -> Any:
    if name == "string":
        return "".join(generator.choice(list("abc_/ äß0"), size=generator.integers(0, 9)))
    if name == "bool":
        return bool(generator.integers(2))
    if name.startswith("float"):
        return float(generator.normal())
    return int(generator.integers(0, 100))


def write_bag(
    folder: Path,
    messages_per_topic: int,
    flush_every: int = 0,
    seed: int = 0,
    limits: SplitLimits | None = None,
) -> dict[str, list[Any]]:
    """Write a bag; returns (message, log time, publish time) of each message, by topic."""
    generator = np.random.default_rng(seed)
    written: dict[str, list[Any]] = {topic: [] for topic in TOPICS}
    attachments = {"config.yaml": "name: test\n", "versions.json": "{}"}
    with BagWriter(folder, attachments, limits) as writer:
        for topic, (type_name, offered_qos) in TOPICS.items():
            writer.add_topic(topic, type_name, offered_qos)
        for number, topic, message in _messages(messages_per_topic, generator):
            log_ns, publish_ns = 50_000_000 * number, 1_700_000_000_000_000_000 + 7 * number
            data = bytes(typestore().serialize_cdr(message, message.__msgtype__))
            writer.write(topic, data, log_ns, publish_ns)
            written[topic].append((message, log_ns, publish_ns))
            if flush_every and number % flush_every == 0:
                writer.flush()
    return written


def _messages(number: int, generator: np.random.Generator) -> Iterator[tuple[int, str, Any]]:
    for index in range(number):
        for topic, (type_name, _) in TOPICS.items():
            yield index, topic, random_message(type_name, generator)


def same(a: Any, b: Any) -> bool:
    """Whether a message of rosbags and one of any class have the same content."""
    if isinstance(a, np.ndarray | list | tuple):
        return len(a) == len(b) and all(same(x, y) for x, y in zip(a, b, strict=True))
    if (type_name := getattr(a, "__msgtype__", None)) is not None:
        names = [name for name, _ in typestore().get_msgdef(type_name).fields]
        return all(same(getattr(a, name), getattr(b, name)) for name in names)
    return bool(a == b)


def header(number: int) -> bytes:
    """A serialized std_msgs/Header; its length grows with its number."""
    types = typestore().types
    stamp = types["builtin_interfaces/msg/Time"](sec=number, nanosec=7)
    message = types["std_msgs/msg/Header"](stamp=stamp, frame_id="x" * number)
    return bytes(typestore().serialize_cdr(message, "std_msgs/msg/Header"))


def write_compressed_bag(folder: Path, mode: CompressionMode, headers: Iterable[tuple[int, bytes]]) -> Path:
    """A bag like that of ``ros2 bag record --compression-mode``, from log times and serialized headers."""
    writer = Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP)
    writer.set_compression(mode, CompressionFormat.ZSTD)
    with writer:
        connection = writer.add_connection("/tick", "std_msgs/msg/Header", typestore=typestore())
        for log_time_ns, data in headers:
            writer.write(connection, log_time_ns, data)
    return folder
