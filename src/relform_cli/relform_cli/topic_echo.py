"""``ros2 topic echo``."""

import inspect
import sys
import time
from argparse import ArgumentParser, Namespace
from collections import deque
from collections.abc import Callable
from functools import reduce
from typing import Any

import yaml
from rclpy.event_handler import QoSMessageLostInfo, SubscriptionEventCallbacks
from rclpy.node import Node

from relform_cli.argument_types import non_negative_int, positive_float
from relform_cli.completion import completed_by
from relform_cli.discovery import discover
from relform_cli.errors import CommandError
from relform_cli.graph import add_graph_arguments, graph_node, spin
from relform_cli.interfaces import message_class
from relform_cli.message_text import TextStyle, is_message, to_csv, to_yaml
from relform_cli.qos import add_qos_arguments, listener_profile
from relform_cli.topic_names import add_topic_argument, complete_message_type, discover_topic

DEFAULT_TRUNCATE_LENGTH = 128


def add_arguments(parser: ArgumentParser) -> None:
    add_graph_arguments(parser)
    add_topic_argument(parser)
    completed_by(
        complete_message_type,
        parser.add_argument(
            "message_type", nargs="?", help="such as std_msgs/msg/String; default: as published"
        ),
    )
    add_qos_arguments(parser, preset="sensor_data")
    add = parser.add_argument
    add("--csv", action="store_true", help="all values on one line, separated by commas")
    add("--field", metavar="NAME", help="only this field, such as pose.pose.position")
    add("-f", "--full-length", action="store_true", help="do not truncate arrays and strings")
    add(
        "-l",
        "--truncate-length",
        type=non_negative_int,
        metavar="N",
        default=DEFAULT_TRUNCATE_LENGTH,
        help=f"number of items of arrays and characters of strings (default: {DEFAULT_TRUNCATE_LENGTH})",
    )
    add("--no-arr", action="store_true", help="do not show the items of arrays")
    add("--no-str", action="store_true", help="do not show strings")
    add("--flow-style", action="store_true", help="arrays on one line")
    add("--no-lost-messages", action="store_true", help="do not report lost messages")
    add("--raw", action="store_true", help="show the bytes on the wire")
    add(
        "--filter", metavar="EXPRESSION", help="show only messages m for which this Python expression is true"
    )
    add("--once", action="store_true", help="exit after the first message")
    add("--timeout", type=positive_float, metavar="SECONDS", help="exit after this time")
    add(
        "-i", "--include-message-info", action="store_true", help="show the times and numbers of each message"
    )


def echo(arguments: Namespace) -> None:
    """Show the messages of a topic."""
    printer = Printer(arguments)
    with graph_node(arguments) as node:
        if arguments.message_type is None:
            type_ = discover_topic(node, arguments.topic_name, arguments)
        else:
            type_ = message_class(arguments.message_type)
            discover(node, arguments)
        received: deque[tuple[Any, dict[str, int]]] = deque()
        end = time.monotonic() + (arguments.timeout or float("inf"))

        def is_done() -> bool:
            while received:
                if printer.print(*received.popleft()) and arguments.once:
                    return True
            return time.monotonic() > end

        subscribe(node, type_, arguments, received.append)
        spin(node, is_done)


def subscribe(
    node: Node, type_: Any, arguments: Namespace, take: Callable[[tuple[Any, dict[str, int]]], None]
) -> None:
    """Subscribe with a callback that takes each message with its info, as one tuple.

    The EventsExecutor of Jazzy passes both in one argument.
    """

    def callback(message_and_info: tuple[Any, dict[str, int]]) -> None:
        take(message_and_info)

    # rclpy passes the info to callbacks with two parameters.
    callback.__signature__ = inspect.signature(lambda message, info: None)  # type: ignore[attr-defined]  # may have one
    node.create_subscription(
        type_,
        arguments.topic_name,
        callback,
        listener_profile(node, arguments.topic_name, arguments),
        event_callbacks=SubscriptionEventCallbacks(
            message_lost=None if arguments.no_lost_messages else report_lost
        ),
        raw=arguments.raw,
    )


class Printer:
    """Prints messages as the options say."""

    def __init__(self, arguments: Namespace) -> None:
        self._arguments = arguments
        self._path = [name for name in (arguments.field or "").split(".") if name]
        if arguments.field is not None and not self._path:
            raise CommandError(f"Invalid field value '{arguments.field}'")
        self._filter = python_filter(arguments.filter)
        self._style = TextStyle(
            None if arguments.full_length else arguments.truncate_length,
            arguments.no_arr,
            arguments.no_str,
            arguments.flow_style,
        )

    def print(self, message: Any, info: dict[str, int]) -> bool:
        """Print a message if it passes the filter, and return whether it did.

        Raises:
            CommandError: the message does not have the field.
        """
        try:
            value = reduce(getattr, self._path, message)
        except AttributeError as error:
            raise CommandError(f"Invalid field '{'.'.join(self._path)}': {error}") from None
        if not self._filter(value):
            return False
        sys.stdout.write(self._text(value, info))  # one call, for each call is flushed
        return True

    def _text(self, value: Any, info: dict[str, int]) -> str:
        with_info = self._arguments.include_message_info
        if not is_message(value):
            heading = (
                f"---Got new message, message info:---\n{info}\n---Message data:---\n" if with_info else ""
            )
            return f"{heading}{value}\n---\n"
        if self._arguments.csv:
            heading = "".join(f"{number}," for number in info.values()) if with_info else ""
            return f"{heading}{to_csv(value, self._style)}\n"
        heading = f"{yaml.dump(info)}---\n" if with_info else ""
        return f"{heading}{to_yaml(value, self._style)}---\n"


def python_filter(expression: str | None) -> Callable[[Any], bool]:
    """A function that evaluates an expression for a message m.

    Raises:
        CommandError: the expression is invalid or, when called, cannot be evaluated.
    """
    try:
        code = compile(expression or "True", "filter", "eval")
    except SyntaxError as error:
        raise CommandError(f"Invalid filter '{expression}': {error.msg}") from None

    def is_wanted(message: Any) -> bool:
        try:
            return bool(eval(code, {"m": message}))
        except Exception as error:  # whatever the user's expression raises
            raise CommandError(f"Invalid filter '{expression}': {error}") from None

    return is_wanted


def report_lost(lost: QoSMessageLostInfo) -> None:
    counts = f"total count change:{lost.total_count_change}\n\ttotal count: {lost.total_count}"
    print(f"A message was lost!!!\n\t{counts}---")
