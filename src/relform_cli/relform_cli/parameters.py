"""Get and set the parameters of another node; parameters in files."""

import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import yaml
from rcl_interfaces.msg import (
    Parameter,
    ParameterDescriptor,
    ParameterType,
    ParameterValue,
    SetParametersResult,
)
from rclpy.node import Node
from rclpy.parameter import PARAMETER_SEPARATOR_STRING, get_parameter_value
from rclpy.parameter_client import AsyncParameterClient
from rclpy.task import Future

from relform_cli.discovery import POLL_PERIOD_S
from relform_cli.errors import CommandError, yaml_problem
from relform_cli.graph import spin

WILDCARD = "/**"
"""The name of all nodes in a file of parameters."""

PATIENCE_S = 5.0
"""How long to wait for the answer of a node."""

# The names of the types in `param describe` and in `param get`.
TYPE_NAMES = {
    ParameterType.PARAMETER_NOT_SET: ("not set", "Parameter not set."),
    ParameterType.PARAMETER_BOOL: ("boolean", "Boolean value is:"),
    ParameterType.PARAMETER_INTEGER: ("integer", "Integer value is:"),
    ParameterType.PARAMETER_DOUBLE: ("double", "Double value is:"),
    ParameterType.PARAMETER_STRING: ("string", "String value is:"),
    ParameterType.PARAMETER_BYTE_ARRAY: ("byte array", "Byte values are:"),
    ParameterType.PARAMETER_BOOL_ARRAY: ("boolean array", "Boolean values are:"),
    ParameterType.PARAMETER_INTEGER_ARRAY: ("integer array", "Integer values are:"),
    ParameterType.PARAMETER_DOUBLE_ARRAY: ("double array", "Double values are:"),
    ParameterType.PARAMETER_STRING_ARRAY: ("string array", "String values are:"),
}


class RemoteParameters:
    """The parameters of another node. All methods raise CommandError if it does not answer in time."""

    def __init__(self, node: Node, node_name: str) -> None:
        self._node = node
        self._node_name = node_name
        self._client = AsyncParameterClient(node, node_name)
        deadline = time.monotonic() + PATIENCE_S
        while not self._client.services_are_ready():
            if time.monotonic() > deadline:
                raise CommandError(
                    f"Wait for service timed out waiting for parameter services for node {node_name}"
                )
            time.sleep(POLL_PERIOD_S)

    def names(self, prefixes: Sequence[str] = ()) -> list[str]:
        """The names of the parameters, sorted."""
        return sorted(self._answer(self._client.list_parameters(list(prefixes))).result.names)

    def values(self, names: Sequence[str]) -> list[ParameterValue]:
        """The values of parameters; fewer than the names if the node refuses some."""
        return list(self._answer(self._client.get_parameters(list(names))).values)

    def descriptors(self, names: Sequence[str]) -> list[ParameterDescriptor]:
        return list(self._answer(self._client.describe_parameters(list(names))).descriptors)

    def set(self, parameters: Sequence[Parameter]) -> list[SetParametersResult]:
        return list(self._answer(self._client.set_parameters(list(parameters))).results)

    def _answer(self, future: Future) -> Any:
        deadline = time.monotonic() + PATIENCE_S
        spin(self._node, lambda: future.done() or time.monotonic() > deadline)
        if not future.done():
            raise CommandError(f"Node {self._node_name} does not answer within {PATIENCE_S:g} s")
        return future.result()


def value_from_text(text: str) -> ParameterValue:
    """The value of a text in YAML; what no parameter can hold is a string.

    Raises:
        CommandError: the text is not YAML, or an integer of more than 64 bits.
    """
    try:
        value = get_parameter_value(text)
    except yaml.YAMLError as error:
        raise CommandError(f"The passed value is not YAML: {yaml_problem(error)}") from None
    except OverflowError:
        raise CommandError(f"{text} has an integer of more than 64 bits") from None
    if value.type == ParameterType.PARAMETER_STRING:
        value.string_value = str(value.string_value if isinstance(value.string_value, str) else text)
    if not -(2**63) <= value.integer_value < 2**63:
        raise CommandError(f"{text} is not an integer of 64 bits")
    return value


def parameters_from_file(path: str, use_wildcard: bool) -> list[Parameter]:
    """The parameters of all nodes in a YAML file, without null values; named nodes override ``/**``.

    rclpy reads such files as well, but takes the string "1" for a number and fails at "a: b".

    Raises:
        CommandError: the file cannot be read, is not a file of parameters, or has none to load.
    """
    try:
        nodes = yaml.safe_load(Path(path).read_text())
    except OSError as error:
        raise CommandError(f"{path}: {error.strerror}") from None
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise CommandError(f"{path} is not YAML: {yaml_problem(error)}") from None
    values: dict[str, Any] = {}
    try:
        # The wildcard first, so that parameters of named nodes replace its.
        selected = [node for node in sorted(nodes, key=WILDCARD.__ne__) if use_wildcard or node != WILDCARD]
        for node in selected:
            values.update(_flat(nodes[node]["ros__parameters"]))
    except (AttributeError, IndexError, KeyError, TypeError):
        raise CommandError(f"{path} is not '<node>: {{ros__parameters: {{...}}}}'") from None
    if not selected:
        raise CommandError("Param file does not contain selected parameters")
    return [
        Parameter(name=name, value=value_from_text(yaml.safe_dump(value, default_flow_style=True)))
        for name, value in values.items()
        if value is not None
    ]


def _flat(tree: dict[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    for name, value in tree.items():
        if isinstance(value, dict):
            yield from _flat(value, f"{prefix}{name}{PARAMETER_SEPARATOR_STRING}")
        else:
            yield f"{prefix}{name}", value
