"""Nodes by name."""

from argparse import ArgumentParser, Namespace

from relform_cli.completion import completed_by
from relform_cli.graph import glanced_at, node_names


def add_node_argument(parser: ArgumentParser, optional: bool = False) -> None:
    argument = parser.add_argument("node_name", nargs="?" if optional else None, help="such as /talker")
    completed_by(complete_node, argument)


def complete_node(parsed_args: Namespace, **_: object) -> list[str]:
    with glanced_at(parsed_args) as node:
        return node_names(node, getattr(parsed_args, "include_hidden_nodes", False))
