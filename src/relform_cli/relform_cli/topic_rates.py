"""``ros2 topic hz``, ``bw`` and ``delay``."""

import time
from argparse import ArgumentParser, Namespace
from collections import deque
from collections.abc import Callable
from typing import Any

from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.serialization import deserialize_message

from relform_cli.argument_types import positive_int
from relform_cli.errors import CommandError
from relform_cli.graph import add_spin_arguments, graph_node, spin
from relform_cli.meters import BandwidthMeter, DelayMeter, Meter, RateMeter
from relform_cli.qos import DEPTH_OF_LISTENERS
from relform_cli.topic_echo import python_filter
from relform_cli.topic_names import add_topic_argument, discover_topic

REPORT_PERIOD_S = 1.0
MANY = 10000
"""Default number of messages in a window."""


def add_hz_arguments(parser: ArgumentParser) -> None:
    _add_arguments(parser, window=MANY)
    parser.add_argument(
        "--filter", metavar="EXPRESSION", help="count messages m for which this Python expression is true"
    )
    parser.add_argument(
        "--wall-time", action="store_true", help="measure with wall time, also with --use-sim-time"
    )


def add_bw_arguments(parser: ArgumentParser) -> None:
    _add_arguments(parser, window=100)


def add_delay_arguments(parser: ArgumentParser) -> None:
    _add_arguments(parser, window=MANY)


def _add_arguments(parser: ArgumentParser, window: int) -> None:
    add_topic_argument(parser)
    parser.add_argument(
        "-w",
        "--window",
        type=positive_int,
        default=window,
        metavar="N",
        help=f"measure over this many messages (default: {window})",
    )
    add_spin_arguments(parser)


def hz(arguments: Namespace) -> None:
    """Show how often messages arrive."""
    is_wanted = python_filter(arguments.filter)

    def number(type_: Any, data: bytes) -> int | None:
        return 0 if arguments.filter is None or is_wanted(deserialize_message(data, type_)) else None

    _measure(arguments, RateMeter(arguments.window), number, wall_time=arguments.wall_time)


def bw(arguments: Namespace) -> None:
    """Show how many bytes arrive."""
    print_first = f"Subscribed to [{arguments.topic_name}]"
    _measure(arguments, BandwidthMeter(arguments.window), lambda _, data: len(data), print_first)


def delay(arguments: Namespace) -> None:
    """Show how old messages are when they arrive, by the stamps in their headers."""

    def stamp(type_: Any, data: bytes) -> int:
        if not hasattr(type_, "header"):
            raise CommandError("msg does not have header")
        header_stamp = deserialize_message(data, type_).header.stamp
        return int(header_stamp.sec) * 10**9 + int(header_stamp.nanosec)

    _measure(arguments, DelayMeter(arguments.window), stamp)


def _measure(
    arguments: Namespace,
    meter: Meter,
    number: Callable[[Any, bytes], int | None],
    print_first: str | None = None,
    wall_time: bool = False,
) -> None:
    """Print reports until a signal ends the command.

    Args:
        number: the meter's number of a serialized message, or None to leave the message out.
    """
    with graph_node(arguments) as node:
        type_ = discover_topic(node, arguments.topic_name, arguments, wait=True)
        clock = Clock(clock_type=ClockType.SYSTEM_TIME) if wall_time else node.get_clock()

        received: deque[tuple[int, Any]] = deque()
        next_report = time.monotonic() + REPORT_PERIOD_S

        def is_done() -> bool:
            nonlocal next_report
            while received:
                now_ns, data = received.popleft()
                value = number(type_, data)
                if now_ns > 0 and value is not None:  # before the first /clock it is 0
                    meter.take(now_ns, value)
            if time.monotonic() >= next_report:
                next_report += REPORT_PERIOD_S
                text = meter.report(clock.now().nanoseconds)
                if text is not None:
                    print(text)
            return False

        profile = QoSProfile(depth=DEPTH_OF_LISTENERS, reliability=ReliabilityPolicy.BEST_EFFORT)
        node.create_subscription(
            type_,
            arguments.topic_name,
            lambda data: received.append((clock.now().nanoseconds, data)),
            profile,
            raw=True,
        )
        if print_first:
            print(print_first)
        spin(node, is_done)
