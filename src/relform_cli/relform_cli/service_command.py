"""Services: list them, show their types, call them."""

import sys
import time
from argparse import ArgumentParser, Namespace
from typing import Any

from rclpy.client import Client
from rclpy.node import Node

from relform_cli.commands import VerbParsers
from relform_cli.completion import completed_by
from relform_cli.discovery import POLL_PERIOD_S, discover, discover_all
from relform_cli.errors import CommandError
from relform_cli.graph import (
    NamesAndTypes,
    add_graph_arguments,
    glanced_at,
    graph_node,
    services,
    spin,
)
from relform_cli.interfaces import all_interfaces, service_class
from relform_cli.listing import (
    add_find_arguments,
    add_hidden_argument,
    add_list_arguments,
    print_found,
    print_list,
)
from relform_cli.message_fields import message_from_yaml
from relform_cli.message_text import to_yaml

PATIENCE_S = 1.0
"""After this time without the service, a line says so."""


def add_arguments(parser: ArgumentParser) -> None:
    add_hidden_argument(parser, "services", default=False)
    verbs = VerbParsers(parser)

    add_list_arguments(verbs.add("list", list_services), "services")
    verb = verbs.add("type", print_type)
    add_graph_arguments(verb)
    add_service_argument(verb)

    add_find_arguments(verbs.add("find", find), "services", "srv")

    verb = verbs.add("call", call)
    add_service_argument(verb)
    completed_by(
        complete_type_of_service, verb.add_argument("service_type", help="such as std_srvs/srv/Trigger")
    )
    values = verb.add_mutually_exclusive_group()
    completed_by(
        complete_values,
        values.add_argument("values", nargs="?", default="{}", help='YAML, such as "{data: true}"'),
    )
    values.add_argument("--stdin", action="store_true", help="read the values from stdin")
    verb.add_argument("-r", "--rate", type=float, metavar="HZ", help="call repeatedly at this rate")


def add_service_argument(parser: ArgumentParser) -> None:
    completed_by(complete_service, parser.add_argument("service_name", help="such as /leader/start"))


def complete_service(parsed_args: Namespace, **_: object) -> list[str]:
    with glanced_at(parsed_args) as node:
        return [name for name, _ in services(node, parsed_args.include_hidden)]


def complete_type_of_service(parsed_args: Namespace, **_: object) -> list[str]:
    """The types of the service named before; all types if it has none."""
    with glanced_at(parsed_args) as node:
        types = dict(services(node, include_hidden=True)).get(parsed_args.service_name)
    return types or all_interfaces("srv")


def complete_values(parsed_args: Namespace, **_: object) -> list[str]:
    return [to_yaml(service_class(parsed_args.service_type).Request())]


def discovered_services(arguments: Namespace) -> NamesAndTypes:
    with graph_node(arguments) as node:
        discover_all(node, arguments)
        return services(node, arguments.include_hidden)


def list_services(arguments: Namespace) -> None:
    """List the services."""
    print_list(discovered_services(arguments), arguments)


def print_type(arguments: Namespace) -> int:
    """Print the type of a service."""
    with graph_node(arguments) as node:

        def types() -> list[str]:
            return dict(services(node, arguments.include_hidden)).get(arguments.service_name, [])

        discover(node, arguments, wanted=lambda: bool(types()), quiet_s=0.0)
        for type_ in types():
            print(type_)
        return 0 if types() else 1


def find(arguments: Namespace) -> None:
    """List the services of a type."""
    print_found(discovered_services(arguments), arguments)


def call(arguments: Namespace) -> None:
    """Call a service once or repeatedly."""
    if arguments.rate is not None and not arguments.rate > 0.0:
        raise CommandError("rate must be greater than zero")
    type_ = service_class(arguments.service_type)
    request, _ = message_from_yaml(type_.Request, sys.stdin.read() if arguments.stdin else arguments.values)
    with graph_node(arguments) as node:
        client = node.create_client(type_, arguments.service_name)
        wait_for_service(client)
        while True:
            start = time.monotonic()
            call_once(node, client, request)
            if arguments.rate is None:
                return
            time.sleep(max(0.0, start + 1.0 / arguments.rate - time.monotonic()))


def wait_for_service(client: Client) -> None:
    start, is_reported = time.monotonic(), False
    while not client.service_is_ready():
        if not is_reported and time.monotonic() - start > PATIENCE_S:
            print("waiting for service to become available...")
            is_reported = True
        time.sleep(POLL_PERIOD_S)


def call_once(node: Node, client: Client, request: Any) -> None:
    print(f"requester: making request: {request!r}\n")
    future = client.call_async(request)
    spin(node, future.done)
    print(f"response:\n{future.result()!r}\n")
