"""Waiting, without a daemon, until a node has discovered the ROS graph."""

import sys
import time
from argparse import Namespace
from collections.abc import Callable

from rclpy.node import Node

from relform_cli.participants import OpenPorts, discovered, n_of_ros

QUIET_S = 0.5
"""A graph that has not changed for this long is taken for complete."""

LONGEST_S = 2.0
"""How long to wait for a complete graph."""

LONGEST_INCOMPLETE_S = 8.0
"""How long to wait while parts of the graph are known to be missing: a busy machine may be slow."""

POLL_PERIOD_S = 0.02


def discover(
    node: Node,
    arguments: Namespace,
    wanted: Callable[[], bool] = lambda: True,
    quiet_s: float = QUIET_S,
    longest_s: float = LONGEST_S,
    longest_incomplete_s: float = LONGEST_INCOMPLETE_S,
) -> str | None:
    """Wait until the graph is complete, does not change and holds what is wanted.

    Args:
        arguments: ``spin_time`` replaces all other times.
        quiet_s: how long the graph must not change; with 0 it need not be complete either.
        longest_s: give up after this time, after twice this time while the graph changes,
        longest_incomplete_s: or after this time while parts are known to be missing.

    Returns:
        What is known to be missing, or None.
    """
    ports = OpenPorts(node.context.get_domain_id())
    at_start = ports.update()
    if arguments.spin_time is not None:
        time.sleep(arguments.spin_time)
        return missing(node, at_start & ports.update())
    start = since = time.monotonic()
    seen = None
    while True:
        now = time.monotonic()
        running = ports.update()
        picture = _picture(node)
        if picture != seen:
            seen, since = picture, now
        is_quiet = now - since >= quiet_s
        is_found = is_quiet and len(node.get_node_names()) > 1 and wanted()
        if is_found and quiet_s == 0.0:
            return None
        if is_found or now - start >= (longest_s if is_quiet else 2.0 * longest_s):
            if missing(node, running) is None:
                return None
            if now - start >= longest_incomplete_s:
                return missing(node, at_start & running)
        time.sleep(POLL_PERIOD_S)


def discover_all(node: Node, arguments: Namespace) -> None:
    """Wait until the graph is complete; say so on stderr if it is known not to be."""
    start = time.monotonic()
    doubt = discover(node, arguments)
    if doubt is not None:
        print(
            f"The list may be incomplete: {doubt} after {time.monotonic() - start:.0f} s; "
            "--spin-time SECONDS sets how long to wait",
            file=sys.stderr,
        )


def _picture(node: Node) -> object:
    topics = node.get_topic_names_and_types()
    counts = [(node.count_publishers(topic), node.count_subscribers(topic)) for topic, _ in topics]
    return (
        n_of_ros(node),
        topics,
        counts,
        node.get_node_names_and_namespaces(),
        node.get_service_names_and_types(),
    )


def missing(node: Node, ports: set[int]) -> str | None:
    """What a node has not discovered yet of the processes with some discovery ports; None if nothing."""
    found = discovered(node)
    n_silent = len(ports) - len(found.participants)
    if n_silent > 0:
        return f"{n_silent} of {len(ports)} ROS processes on this machine have not answered"
    if found.nameless:
        return f"{len(found.nameless)} ROS processes have not sent the names of all their nodes"
    return None
