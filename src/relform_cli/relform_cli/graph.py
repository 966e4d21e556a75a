"""The node of a verb, and the names that it finds in the ROS graph."""

import os
import signal
from argparse import ArgumentParser, Namespace
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import rclpy
from rclpy.exceptions import NameValidationException
from rclpy.expand_topic_name import expand_topic_name
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.node import HIDDEN_NODE_PREFIX, Node
from rclpy.parameter import Parameter
from rclpy.signals import SignalHandlerOptions
from rclpy.topic_or_service_is_hidden import topic_or_service_is_hidden
from rclpy.utilities import try_shutdown
from rclpy.validate_full_topic_name import validate_full_topic_name
from rclpy.validate_node_name import validate_node_name

from relform_cli.argument_types import non_negative_float
from relform_cli.discovery import LONGEST_S, discover
from relform_cli.errors import CommandError

TAB_QUIET_S = 0.3
TAB_LONGEST_S = 4.0

NamesAndTypes = list[tuple[str, list[str]]]


def add_graph_arguments(parser: ArgumentParser) -> None:
    """Add the options of verbs that use a daemon in ros2cli."""
    add_spin_arguments(parser)
    parser.add_argument("--no-daemon", action="store_true", help="accepted; there is no daemon")


def add_spin_arguments(parser: ArgumentParser) -> None:
    """Add the options of every verb that has a node."""
    parser.add_argument(
        "--spin-time",
        type=non_negative_float,
        metavar="SECONDS",
        help=f"wait this long for discovery (default: until the graph is complete, about {LONGEST_S:g} s)",
    )
    parser.add_argument("-s", "--use-sim-time", action="store_true", help="use the time of /clock")


@contextmanager
def graph_node(arguments: Namespace, name: str | None = None) -> Iterator[Node]:
    """A node for the time that a verb runs, hidden unless it has a name of its own.

    Raises:
        CommandError: a name that is passed to ROS inside is invalid.
    """
    # With Python's own handlers signals raise exceptions here; those of rclpy shut the context down.
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    # A shell starts background jobs of scripts with SIGINT ignored, and Python leaves it so.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    name = name or f"{HIDDEN_NODE_PREFIX}ros2cli_{os.getpid()}"
    try:
        validate_node_name(name)  # create_node would print a second warning
        yield rclpy.create_node(
            name,
            start_parameter_services=False,
            parameter_overrides=[
                Parameter("use_sim_time", value=getattr(arguments, "use_sim_time", False)),
                Parameter("start_type_description_service", value=False),
            ],
        )
    except NameValidationException as error:
        what, where, *_ = str(error).splitlines()  # and a caret below
        raise CommandError(f"{what} {where.strip()}") from None
    finally:
        try_shutdown()


def spin(node: Node, is_done: Callable[[], bool]) -> None:
    """Run the node's callbacks until ``is_done``, which is called after each of them and every 0.1 s.

    Callbacks should only store what they receive, and ``is_done`` do the work: the executor reports what a
    callback raises with a traceback.
    """
    executor = EventsExecutor()  # its spin() ignores signals in the wheels of Jazzy
    executor.add_node(node)
    while not is_done():
        with deferred_signals():
            executor.spin_once(timeout_sec=0.1)


@contextmanager
def deferred_signals() -> Iterator[None]:
    """Delay SIGINT and SIGTERM to the end of the block."""
    arrived: list[int] = []

    def note(number: int, _: object) -> None:
        arrived.append(number)

    handlers = {number: signal.signal(number, note) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)
    for arrival in arrived:
        signal.raise_signal(arrival)


@contextmanager
def glanced_at(arguments: Namespace) -> Iterator[Node]:
    """The graph for completers: after pressing Tab people do not like to wait."""
    with graph_node(arguments) as node:
        discover(node, Namespace(spin_time=None), quiet_s=TAB_QUIET_S, longest_incomplete_s=TAB_LONGEST_S)
        yield node


def topics(node: Node, include_hidden: bool) -> NamesAndTypes:
    return _visible(node.get_topic_names_and_types(), include_hidden)


def services(node: Node, include_hidden: bool) -> NamesAndTypes:
    return _visible(node.get_service_names_and_types(), include_hidden)


def _visible(names_and_types: NamesAndTypes, include_hidden: bool) -> NamesAndTypes:
    return [entry for entry in names_and_types if include_hidden or not topic_or_service_is_hidden(entry[0])]


def node_names(node: Node, include_hidden: bool) -> list[str]:
    """The other nodes, fully qualified and sorted; twice where two share a name."""
    return sorted(
        f"{namespace.rstrip('/')}/{name}"
        for name, namespace in node.get_node_names_and_namespaces()
        if name != node.get_name() and (include_hidden or not name.startswith(HIDDEN_NODE_PREFIX))
    )


def full_topic_name(node: Node, name: str) -> str:
    """The full name of a topic, as in the graph.

    Raises:
        CommandError: the name is not valid for a topic.
    """
    try:
        full_name = expand_topic_name(name, node.get_name(), node.get_namespace())
    except ValueError as error:
        raise CommandError(
            str(error).partition(", at ")[0]
        ) from None  # without the position in the source of rcl
    validate_full_topic_name(full_name)
    return full_name
