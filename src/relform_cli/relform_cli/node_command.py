"""Nodes: list them, and show what they publish, subscribe to and serve."""

import sys
from argparse import ArgumentParser, Namespace

from rclpy.action.graph import (
    get_action_client_names_and_types_by_node,
    get_action_server_names_and_types_by_node,
)
from rclpy.node import HIDDEN_NODE_PREFIX

from relform_cli.commands import VerbParsers
from relform_cli.discovery import discover, discover_all
from relform_cli.errors import CommandError
from relform_cli.graph import add_graph_arguments, graph_node, node_names
from relform_cli.node_names import add_node_argument


def add_arguments(parser: ArgumentParser) -> None:
    verbs = VerbParsers(parser)

    verb = verbs.add("list", list_nodes)
    add_graph_arguments(verb)
    verb.add_argument("-a", "--all", action="store_true", help="hidden nodes as well")
    verb.add_argument("-c", "--count-nodes", action="store_true", help="show only the number of nodes")

    verb = verbs.add("info", info)
    add_graph_arguments(verb)
    add_node_argument(verb)
    verb.add_argument(
        "--include-hidden", action="store_true", help="hidden topics, services and actions as well"
    )


def list_nodes(arguments: Namespace) -> None:
    """List the nodes."""
    with graph_node(arguments) as node:
        discover_all(node, arguments)
        names = node_names(node, arguments.all)
    if arguments.count_nodes:
        print(len(names))
        return
    if len(set(names)) < len(names):
        print(
            "WARNING: Be aware that there are nodes in the graph that share an exact name, "
            "which can have unintended side effects.",
            file=sys.stderr,
        )
    for name in names:
        print(name)


def info(arguments: Namespace) -> None:
    """Show what a node publishes, subscribes to and serves."""
    full_name = arguments.node_name
    with graph_node(arguments) as node:
        discover(node, arguments, wanted=lambda: full_name in node_names(node, include_hidden=True))
        namesakes = node_names(node, arguments.include_hidden).count(full_name)
        if namesakes == 0:
            raise CommandError(f"Unable to find node '{full_name}'")
        if namesakes > 1:
            print(
                f'There are {namesakes} nodes in the graph with the exact name "{full_name}". '
                "You are seeing information about only one of them.",
                file=sys.stderr,
            )
        namespace, _, name = full_name.rpartition("/")
        address = name, namespace or "/"
        print(full_name)
        for heading, names_and_types in (
            ("Subscribers", node.get_subscriber_names_and_types_by_node(*address)),
            ("Publishers", node.get_publisher_names_and_types_by_node(*address)),
            ("Service Servers", node.get_service_names_and_types_by_node(*address)),
            ("Service Clients", node.get_client_names_and_types_by_node(*address)),
            ("Action Servers", get_action_server_names_and_types_by_node(node, *address)),
            ("Action Clients", get_action_client_names_and_types_by_node(node, *address)),
        ):
            shown = [
                entry for entry in names_and_types if arguments.include_hidden or not is_hidden(entry[0])
            ]
            print(f"  {heading}:")
            print(*(f"    {name}: {', '.join(types)}" for name, types in shown), sep="\n")


def is_hidden(name: str) -> bool:
    return any(part.startswith(HIDDEN_NODE_PREFIX) for part in name.split("/"))
