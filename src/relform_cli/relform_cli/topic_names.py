"""Topics by name: arguments, completions and types."""

import time
from argparse import ArgumentParser, Namespace
from typing import Any

from rclpy.node import Node

from relform_cli.completion import completed_by
from relform_cli.discovery import POLL_PERIOD_S, discover
from relform_cli.errors import CommandError
from relform_cli.graph import full_topic_name, glanced_at, topics
from relform_cli.interfaces import all_interfaces, message_class


def add_topic_argument(parser: ArgumentParser, dest: str = "topic_name") -> None:
    completed_by(complete_topic, parser.add_argument(dest, help="such as /chatter"))


def complete_topic(parsed_args: Namespace, **_: object) -> list[str]:
    with glanced_at(parsed_args) as node:
        return [name for name, _ in topics(node, parsed_args.include_hidden)]


def complete_message_type(parsed_args: Namespace, **_: object) -> list[str]:
    """The types of the topic named before; all types if it has none."""
    with glanced_at(parsed_args) as node:
        return topic_types(node, parsed_args.topic_name) or all_interfaces("msg")


def discover_topic(node: Node, topic: str, arguments: Namespace, wait: bool = False) -> Any:
    """The message class of a topic in the graph.

    Args:
        wait: wait for the topic without limit.

    Raises:
        CommandError: the topic is not found, has more than one type, or its type is not installed.
    """
    name = full_topic_name(node, topic)
    discover(node, arguments, wanted=lambda: bool(topic_types(node, name)))
    types = topic_types(node, name)
    if not types:
        print(f"WARNING: topic [{topic}] does not appear to be published yet")
        if not wait:
            raise CommandError("Could not determine the type for the passed topic")
        while not (types := topic_types(node, name)):
            time.sleep(POLL_PERIOD_S)
    if len(types) > 1:
        raise CommandError(
            f"Cannot echo topic '{topic}', as it contains more than one type: [{', '.join(types)}]"
        )
    try:
        return message_class(types[0])
    except CommandError:
        raise CommandError(f"The message type '{types[0]}' is invalid: it is not installed here") from None


def topic_types(node: Node, name: str) -> list[str]:
    return dict(topics(node, include_hidden=True)).get(name, [])
