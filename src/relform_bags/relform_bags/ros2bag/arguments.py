"""The arguments of ``ros2 bag``: those of ros2bag in Jazzy that have a meaning here."""

from argparse import ArgumentParser, ArgumentTypeError
from pathlib import Path

from relform_cli.argument_types import non_negative_int, positive_float

DEFAULT_CLOCK_HZ = 40.0
STORAGES = ["mcap"]


def add_info_arguments(parser: ArgumentParser) -> None:
    _add_bag_arguments(parser)
    parser.add_argument("-t", "--topic-name", action="store_true", help="only the names of the topics")
    parser.add_argument("-v", "--verbose", action="store_true", help="accepted; there is no more to say")


def add_play_arguments(parser: ArgumentParser) -> None:
    _add_bag_arguments(parser)
    parser.add_argument("-r", "--rate", type=positive_float, default=1.0, help="bag time per wall time")
    parser.add_argument("-l", "--loop", action="store_true", help="start again at the end")
    parser.add_argument("-p", "--start-paused", action="store_true", help="wait for the space key")
    parser.add_argument(
        "-d", "--delay", type=positive_float, default=0.0, metavar="S", help="before each start"
    )
    parser.add_argument("--start-offset", type=_not_negative, default=0.0, metavar="S", help="skip so much")
    parser.add_argument("--playback-duration", type=float, default=-1.0, metavar="S", help="play so much")
    until = parser.add_mutually_exclusive_group()
    until.add_argument("--playback-until-sec", type=float, default=-1.0, metavar="S", help="time to end at")
    until.add_argument("--playback-until-nsec", type=int, default=-1, metavar="NS", help="time to end at")
    topics = parser.add_argument_group("topics")
    topics.add_argument("--topics", nargs="+", default=[], metavar="TOPIC", help="play only these")
    topics.add_argument("-e", "--regex", default="", help="play only those whose whole name matches")
    topics.add_argument(
        "-x", "--exclude-regex", default="", help="do not play those whose whole name matches"
    )
    topics.add_argument("--exclude-topics", nargs="+", default=[], metavar="TOPIC", help="do not play these")
    topics.add_argument(
        "-m", "--remap", nargs="+", default=[], metavar="OLD:=NEW", help="play a topic under another name"
    )
    clock = parser.add_mutually_exclusive_group()
    clock.add_argument(
        "--clock",
        type=positive_float,
        nargs="?",
        const=DEFAULT_CLOCK_HZ,
        default=0.0,
        metavar="HZ",
        help=f"publish /clock at this rate ({DEFAULT_CLOCK_HZ:g}) in place of the recorded one",
    )
    clock.add_argument(
        "--clock-topics", nargs="+", default=[], metavar="TOPIC", help="/clock before each of these"
    )
    clock.add_argument("--clock-topics-all", action="store_true", help="/clock before every message")
    parser.add_argument(
        "--wait-for-all-acked", type=non_negative_int, metavar="MS", help="for the last messages; 0: for ever"
    )
    parser.add_argument("--read-ahead-queue-size", type=int, help="accepted; the whole bag is read ahead")
    parser.add_argument("--disable-loan-message", action="store_true", help="accepted; none is on loan")
    _add_node_arguments(parser)


def add_record_arguments(parser: ArgumentParser) -> None:
    parser.add_argument("-o", "--output", type=Path, help="folder of the new bag (default: rosbag2_<time>)")
    parser.add_argument("-s", "--storage", choices=STORAGES, default="mcap", help="format of the bag")
    topics = parser.add_argument_group("topics, of which something must be said")
    names = topics.add_mutually_exclusive_group()
    names.add_argument(
        "topics_positional", nargs="*", default=[], metavar="TOPIC", help="the same as --topics"
    )
    names.add_argument("--topics", nargs="+", default=[], metavar="TOPIC", help="record these")
    topics.add_argument("-a", "--all", "--all-topics", action="store_true", help="record all")
    topics.add_argument("-e", "--regex", default="", help="record those in whose name it is found")
    topics.add_argument(
        "--topic-types", nargs="+", default=[], metavar="TYPE", help="record those of these types"
    )
    topics.add_argument("--exclude-regex", default="", help="do not record those in whose name it is found")
    topics.add_argument(
        "--exclude-topics", nargs="+", default=[], metavar="TOPIC", help="do not record these"
    )
    topics.add_argument(
        "--exclude-topic-types", nargs="+", default=[], metavar="TYPE", help="nor those of these"
    )
    topics.add_argument("--include-hidden-topics", action="store_true", help="record hidden topics, too")
    parser.add_argument(
        "-b",
        "--max-bag-size",
        type=int,
        default=0,
        metavar="BYTES",
        help="go on in the next file at this size",
    )
    parser.add_argument(
        "-d",
        "--max-bag-duration",
        type=int,
        default=0,
        metavar="S",
        help="go on in the next file after so long",
    )
    parser.add_argument("--use-sim-time", action="store_true", help="log the time of /clock")
    parser.add_argument("--start-paused", action="store_true", help="wait for the space key")
    parser.add_argument("--node-name", default="rosbag2_recorder", help="default: %(default)s")
    parser.add_argument(
        "-p", "--polling-interval", type=int, help="accepted; topics are looked for every 0.1 s"
    )
    parser.add_argument("--max-cache-size", type=int, help="accepted; messages are on disk within 0.5 s")
    _add_node_arguments(parser)


def _add_bag_arguments(parser: ArgumentParser) -> None:
    parser.add_argument("bag_path", type=_existing, help="bag: its folder, a file, or the folder of a run")
    parser.add_argument("-s", "--storage", choices=STORAGES, help="format of the bag")


def _add_node_arguments(parser: ArgumentParser) -> None:
    parser.add_argument("--disable-keyboard-controls", action="store_true", help="do not listen to keys")
    levels = ["debug", "info", "warn", "error", "fatal"]
    parser.add_argument("--log-level", choices=levels, default="info", help="what to print (default: info)")


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
