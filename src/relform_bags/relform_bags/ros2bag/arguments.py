"""The arguments of ``ros2 bag``: those of ros2bag in Jazzy that have a meaning here.

Most of them set an option of the node: its name is their destination, its default is theirs.
"""

import math
from argparse import ArgumentParser, ArgumentTypeError
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, Protocol

from relform_bags.options import DESCRIPTION, Options, PlayerOptions, TopicRecorderOptions
from relform_cli.argument_types import non_negative_int, positive_float
from relform_core.units import NANOSECONDS_PER_SECOND

DEFAULT_CLOCK_HZ = 40.0
STORAGES = ["mcap"]


class _ArgumentTarget(Protocol):
    """A parser or a group of its arguments."""

    def add_argument(self, *flags: str, **details: Any) -> object: ...


def add_info_arguments(parser: ArgumentParser) -> None:
    _add_bag_arguments(parser)
    parser.add_argument("-t", "--topic-name", action="store_true", help="Print only the names of the topics.")
    parser.add_argument("-v", "--verbose", action="store_true", help="Accepted; changes nothing.")


def add_play_arguments(parser: ArgumentParser) -> None:
    option = partial(_add_option, PlayerOptions)
    _add_bag_arguments(parser)
    option(parser, "rate", "-r", "--rate", type=positive_float)
    option(parser, "loop", "-l", "--loop", action="store_true")
    option(parser, "start_paused", "-p", "--start-paused", action="store_true")
    option(parser, "delay_s", "-d", "--delay", type=positive_float, metavar="S")
    option(parser, "start_offset_s", "--start-offset", type=_not_negative, metavar="S")
    option(parser, "duration_s", "--playback-duration", type=float, metavar="S")
    until = parser.add_mutually_exclusive_group()
    option(until, "until_ns", "--playback-until-nsec", type=int, metavar="NS")
    option(
        until, "until_ns", "--playback-until-sec", type=_seconds, metavar="S", help="The same in seconds [s]."
    )
    topics = parser.add_argument_group("topics")
    option(topics, "topics", "--topics", nargs="+", metavar="TOPIC")
    option(topics, "regex", "-e", "--regex")
    option(topics, "exclude_regex", "-x", "--exclude-regex")
    option(topics, "exclude_topics", "--exclude-topics", nargs="+", metavar="TOPIC")
    topics.add_argument(
        "-m", "--remap", nargs="+", default=[], metavar="OLD:=NEW", help="Play a topic under another name."
    )
    clock = parser.add_mutually_exclusive_group()
    option(
        clock,
        "clock_hz",
        "--clock",
        type=positive_float,
        nargs="?",
        const=DEFAULT_CLOCK_HZ,
        metavar="HZ",
        help=f"Publish /clock at this rate ({DEFAULT_CLOCK_HZ:g}), in place of the recorded one.",
    )
    option(clock, "clock_topics", "--clock-topics", nargs="+", metavar="TOPIC")
    option(clock, "clock_topics_all", "--clock-topics-all", action="store_true")
    option(
        parser,
        "ack_wait_s",
        "--wait-for-all-acked",
        type=_milliseconds,
        metavar="MS",
        help="Wall time to wait until the last messages arrive [ms]; 0: no limit.",
    )
    parser.add_argument("--read-ahead-queue-size", type=int, help="Accepted; the whole bag is read ahead.")
    parser.add_argument("--disable-loan-message", action="store_true", help="Accepted; messages are copied.")
    _add_node_arguments(parser, option)


def add_record_arguments(parser: ArgumentParser) -> None:
    option = partial(_add_option, TopicRecorderOptions)
    option(parser, "output", "-o", "--output", help="Folder of the new bag (default: rosbag2_<time>).")
    parser.add_argument("-s", "--storage", choices=STORAGES, default="mcap", help="Format of the bag.")
    topics = parser.add_argument_group("topics, at least one of these")
    names = topics.add_mutually_exclusive_group()
    names.add_argument("topics_positional", nargs="*", default=[], metavar="TOPIC", help="As --topics.")
    option(names, "topics", "--topics", nargs="+", metavar="TOPIC", help="Topics to record.")
    topics.add_argument("-a", "--all", "--all-topics", action="store_true", help="Record all topics.")
    option(topics, "regex", "-e", "--regex")
    option(topics, "topic_types", "--topic-types", nargs="+", metavar="TYPE")
    option(topics, "exclude_regex", "--exclude-regex")
    option(topics, "exclude_topics", "--exclude-topics", nargs="+", metavar="TOPIC")
    option(topics, "exclude_topic_types", "--exclude-topic-types", nargs="+", metavar="TYPE")
    option(topics, "include_hidden_topics", "--include-hidden-topics", action="store_true")
    option(parser, "max_bag_size", "-b", "--max-bag-size", type=int, metavar="BYTES")
    option(parser, "max_bag_duration", "-d", "--max-bag-duration", type=int, metavar="S")
    parser.add_argument("--use-sim-time", action="store_true", help="Log the time of /clock.")
    option(parser, "start_paused", "--start-paused", action="store_true")
    parser.add_argument("--node-name", default="rosbag2_recorder", help="Name of the node (%(default)s).")
    parser.add_argument(
        "-p", "--polling-interval", type=int, help="Accepted; new topics are looked for every 0.1 s."
    )
    parser.add_argument("--max-cache-size", type=int, help="Accepted; messages are on disk within 0.5 s.")
    _add_node_arguments(parser, option)


def _add_option(
    kind: type[Options], target: _ArgumentTarget, option: str, *flags: str, **details: Any
) -> None:
    """Add the argument of an option, with its default and description unless the details have others."""
    field = kind.__dataclass_fields__[option]
    details = {"default": field.default, "help": field.metadata[DESCRIPTION], **details}
    target.add_argument(*flags, dest=option, **details)


def _add_bag_arguments(parser: ArgumentParser) -> None:
    parser.add_argument("bag_path", type=_existing, help="Bag: its folder, a file, or the folder of a run.")
    parser.add_argument("-s", "--storage", choices=STORAGES, help="Format of the bag.")


def _add_node_arguments(parser: ArgumentParser, option: Callable[..., None]) -> None:
    option(
        parser,
        "keyboard",
        "--disable-keyboard-controls",
        action="store_false",
        help="Do not listen to the keys of the terminal.",
    )
    levels = ["debug", "info", "warn", "error", "fatal"]
    parser.add_argument("--log-level", choices=levels, default="info", help="What to print (%(default)s).")


def _existing(text: str) -> Path:
    path = Path(text)
    if not path.exists():
        raise ArgumentTypeError(f"Bag path '{text}' does not exist!")
    return path


def _not_negative(text: str) -> float:
    value = float(text)
    if not value >= 0.0:
        raise ArgumentTypeError(f"Value {text} is less than zero.")
    return value


def _seconds(text: str) -> int:
    """A time in seconds, as nanoseconds."""
    value = float(text)
    if not math.isfinite(value):
        raise ArgumentTypeError(f"{text} must be finite")
    return round(value * NANOSECONDS_PER_SECOND)


def _milliseconds(text: str) -> float:
    """A duration in milliseconds, as seconds."""
    return non_negative_int(text) / 1000.0
