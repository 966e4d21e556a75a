"""Parameters of nodes: list, show, set, dump and load them."""

import re
import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import yaml
from rcl_interfaces.msg import (
    Parameter,
    ParameterDescriptor,
    ParameterType,
    ParameterValue,
    SetParametersResult,
)
from rclpy.parameter import PARAMETER_SEPARATOR_STRING, parameter_value_to_python

from relform_cli.argument_types import positive_float
from relform_cli.commands import Run, VerbParsers
from relform_cli.completion import completed_by
from relform_cli.discovery import LONGEST_INCOMPLETE_S, LONGEST_S, discover, discover_all
from relform_cli.errors import CommandError
from relform_cli.graph import add_graph_arguments, graph_node, node_names
from relform_cli.node_names import add_node_argument
from relform_cli.parameters import TYPE_NAMES, RemoteParameters, parameters_from_file, value_from_text


def add_arguments(parser: ArgumentParser) -> None:
    verbs = VerbParsers(parser)

    verb = verbs.add("list", list_parameters)
    add_graph_arguments(verb)
    add_node_argument(verb, optional=True)
    add_hidden_argument(verb)
    verb.add_argument("--filter", metavar="REGEX", help="only parameters that match")
    verb.add_argument(
        "--param-prefixes",
        nargs="+",
        default=[],
        metavar="PREFIX",
        help="only with these prefixes",
    )
    verb.add_argument("--param-type", action="store_true", help="show the types as well")

    verb = add_verb_of_node(verbs, "get", get)
    add_parameter_argument(verb)
    verb.add_argument("--hide-type", action="store_true", help="show only the value")

    verb = add_verb_of_node(verbs, "set", set_parameter)
    add_parameter_argument(verb)
    verb.add_argument("value", help="in YAML")

    verb = add_verb_of_node(verbs, "delete", delete)
    add_parameter_argument(verb)

    add_verb_of_node(verbs, "dump", dump)

    verb = add_verb_of_node(verbs, "load", load)
    verb.add_argument("parameter_file", help="as `dump` writes it")
    verb.add_argument("--no-use-wildcard", action="store_true", help="leave out the parameters of /**")

    verb = add_verb_of_node(verbs, "describe", describe)
    completed_by(complete_parameter, verb.add_argument("parameter_names", nargs="+"))


def add_verb_of_node(verbs: VerbParsers, name: str, run: Run) -> ArgumentParser:
    verb = verbs.add(name, run)
    add_graph_arguments(verb)
    add_node_argument(verb)
    add_hidden_argument(verb)
    verb.add_argument(
        "--timeout",
        type=positive_float,
        metavar="SECONDS",
        help=f"wait this long for the node (default: {LONGEST_S:g}, longer on a busy machine)",
    )
    return verb


def add_hidden_argument(parser: ArgumentParser) -> None:
    parser.add_argument("--include-hidden-nodes", action="store_true", help="hidden nodes as well")


def add_parameter_argument(parser: ArgumentParser) -> None:
    completed_by(complete_parameter, parser.add_argument("parameter_name", help="such as use_sim_time"))


def complete_parameter(parsed_args: Namespace, **_: object) -> list[str]:
    with remote_parameters(parsed_args) as parameters:
        return parameters.names()


@contextmanager
def remote_parameters(arguments: Namespace) -> Iterator[RemoteParameters]:
    """The parameters of the node that the arguments name.

    Raises:
        CommandError: the node is not found.
    """
    name = absolute(arguments.node_name)
    with graph_node(arguments) as node:

        def is_there() -> bool:
            return name in node_names(node, arguments.include_hidden_nodes)

        discover(
            node,
            arguments,
            is_there,
            quiet_s=0.0,
            longest_s=arguments.timeout or LONGEST_S,
            longest_incomplete_s=arguments.timeout or LONGEST_INCOMPLETE_S,
        )
        if not is_there():
            raise CommandError("Node not found")
        yield RemoteParameters(node, name)


def absolute(node_name: str) -> str:
    return f"/{node_name.removeprefix('/')}"


def list_parameters(arguments: Namespace) -> None:
    """List the parameters of a node, or of all nodes."""
    try:
        pattern = re.compile(arguments.filter or "")
    except re.error as error:
        raise CommandError(f"'{arguments.filter}' is not a regular expression: {error}") from None
    wanted = arguments.node_name and absolute(arguments.node_name)
    with graph_node(arguments) as node:

        def there() -> list[str]:
            return node_names(node, arguments.include_hidden_nodes)

        if wanted:
            discover(node, arguments, lambda: wanted in there())
            if wanted not in there():
                raise CommandError("Node not found")
        else:
            discover_all(node, arguments)
        for name in [wanted] if wanted else sorted(set(there())):
            try:
                print_parameters(
                    RemoteParameters(node, name), "" if wanted else f"{name}:\n", pattern, arguments
                )
            except CommandError as error:  # the other nodes may answer
                print(error)


def print_parameters(
    parameters: RemoteParameters, heading: str, pattern: re.Pattern[str], arguments: Namespace
) -> None:
    names = [name for name in parameters.names(arguments.param_prefixes) if pattern.match(name)]
    types = [""] * len(names)
    if arguments.param_type:
        types = [f" (type: {TYPE_NAMES[descriptor.type][0]})" for descriptor in parameters.descriptors(names)]
    if names:
        print(heading, end="")
    for name, type_ in zip(names, types, strict=True):
        print(f"  {name}{type_}")


def get(arguments: Namespace) -> None:
    """Show the value of a parameter."""
    with remote_parameters(arguments) as parameters:
        values = parameters.values([arguments.parameter_name])
    if not values:
        raise CommandError("Parameter not set")
    _, label = TYPE_NAMES[values[0].type]
    value = parameter_value_to_python(values[0])
    if arguments.hide_type:
        print(value)
    else:
        print(label if value is None else f"{label} {value}")


def set_parameter(arguments: Namespace) -> None:
    """Set a parameter."""
    parameter = Parameter(name=arguments.parameter_name, value=value_from_text(arguments.value))
    with remote_parameters(arguments) as parameters:
        (result,) = parameters.set([parameter])
    print_result(result, "Set parameter successful", "Setting parameter failed")


def delete(arguments: Namespace) -> None:
    """Delete a parameter, if the node allows it."""
    nothing = ParameterValue(type=ParameterType.PARAMETER_NOT_SET)
    with remote_parameters(arguments) as parameters:
        (result,) = parameters.set([Parameter(name=arguments.parameter_name, value=nothing)])
    print_result(result, "Deleted parameter successfully", "Deleting parameter failed")


def print_result(result: SetParametersResult, success: str, failure: str) -> None:
    reason = f": {result.reason}" if result.reason else ""
    if result.successful:
        print(f"{success}{reason}")
    else:
        print(f"{failure}{reason}", file=sys.stderr)


def dump(arguments: Namespace) -> None:
    """Show all parameters of a node as YAML."""
    tree: dict[str, Any] = {}
    with remote_parameters(arguments) as parameters:
        names = parameters.names()
        for name, value in zip(names, parameters.values(names), strict=True):
            *branches, leaf = name.split(PARAMETER_SEPARATOR_STRING)
            branch = tree
            for part in branches:
                branch = branch.setdefault(part, {})
            branch[leaf] = parameter_value_to_python(value)
    print(yaml.dump({absolute(arguments.node_name): {"ros__parameters": tree}}, default_flow_style=False))


def load(arguments: Namespace) -> None:
    """Set the parameters of a file."""
    to_set = parameters_from_file(arguments.parameter_file, not arguments.no_use_wildcard)
    with remote_parameters(arguments) as parameters:
        results = parameters.set(to_set)
    for parameter, result in zip(to_set, results, strict=True):
        print_result(
            result, f"Set parameter {parameter.name} successful", f"Set parameter {parameter.name} failed"
        )


def describe(arguments: Namespace) -> None:
    """Show the type, description and bounds of parameters."""
    with remote_parameters(arguments) as parameters:
        for descriptor in parameters.descriptors(arguments.parameter_names):
            print_descriptor(descriptor)


def print_descriptor(descriptor: ParameterDescriptor) -> None:
    print("Parameter name:", descriptor.name)
    print("  Type:", TYPE_NAMES[descriptor.type][0])
    if descriptor.description:
        print("  Description:", descriptor.description)
    print("  Constraints:")
    if descriptor.read_only:
        print("    Read only: true")
    for bounds in [*descriptor.floating_point_range, *descriptor.integer_range]:
        print("    Min value:", bounds.from_value)
        print("    Max value:", bounds.to_value)
        if bounds.step:
            print("    Step:", bounds.step)
    if descriptor.additional_constraints:
        print("    Additional constraints:", descriptor.additional_constraints)
