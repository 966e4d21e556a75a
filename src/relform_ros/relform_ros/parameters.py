"""The parameters that nodes read at the start: scenario, observers, and their own."""

import array
import sys
from collections.abc import Mapping
from typing import Any, TypeVar

from rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor
from rclpy.exceptions import InvalidParameterValueException
from rclpy.node import Node
from rclpy.parameter import Parameter

from relform_core.errors import ConfigError
from relform_core.live_values import describe
from relform_core.load import LoadedScenario, load_scenario
from relform_core.nodes_config import NodeParameters
from relform_core.suggestions import did_you_mean

T = TypeVar("T")

EXAMPLES = {
    Parameter.Type.BOOL: "true",
    Parameter.Type.INTEGER: "1",
    Parameter.Type.DOUBLE: "1.0",
    Parameter.Type.DOUBLE_ARRAY: "[1.0, 2.0]",
    Parameter.Type.STRING: "some text",
    Parameter.Type.STRING_ARRAY: "[some, text]",
}
"""A value of each type as it is written."""


def declare(node: Node, name: str, default: T, descriptor: ParameterDescriptor) -> T:
    """Declare a parameter, and return its value at the start of the node.

    Raises:
        ConfigError: one line: the given value cannot be used.
    """
    given = _given(node).get(name)
    value = default if given is None or given.type_ is Parameter.Type.NOT_SET else given.value
    wanted = Parameter.Type.from_parameter_value(default)
    if wanted in (Parameter.Type.DOUBLE, Parameter.Type.DOUBLE_ARRAY):
        value = doubles(value)
    got = Parameter.Type.from_parameter_value(value)
    if got is not wanted:
        example = EXAMPLES[wanted]
        raise ConfigError(
            f"parameter {name} must be of type {wanted.name}, as in {example} (got {value!r}, {got.name})"
        )
    try:
        node.declare_parameter(name, value, descriptor, ignore_override=True)
    except InvalidParameterValueException:
        (bounds,) = descriptor.floating_point_range
        between = f"between {bounds.from_value:g} and {bounds.to_value:g}"
        raise ConfigError(f"parameter {name} must be {between} (got {value})") from None
    return value


def doubles(value: Any) -> Any:
    """The value of a parameter of type double, which may be written as an integer."""
    if type(value) is int:
        return float(value)
    if isinstance(value, list | array.array) and any(type(each) is int for each in value):
        return [doubles(each) for each in value]
    return value


def read_only(
    node: Node, name: str, default: T, description: str, bounds: tuple[float, float] | None = None
) -> T:
    """Declare a parameter that cannot be changed later if it is not declared yet, and read it.

    Args:
        bounds: least and greatest value of a number.
    Raises:
        ConfigError: one line: the given value cannot be used.
    """
    if node.has_parameter(name):
        declared: T = node.get_parameter(name).value
        return declared
    descriptor = ParameterDescriptor(description=description, read_only=True)
    if bounds is not None:
        descriptor.floating_point_range = [FloatingPointRange(from_value=bounds[0], to_value=bounds[1])]
    return declare(node, name, default, descriptor)


def read_described(node: Node, name: str, default: T) -> T:
    """The same with the description and the bounds that ``NodeParameters`` has for the parameter."""
    about = describe(NodeParameters, name)
    return read_only(
        node, name, default, about.description, (about.lowest, about.highest) if about.bounded else None
    )


def read_scenario(node: Node) -> LoadedScenario:
    """Load the scenario that the parameter ``scenario`` names.

    Raises:
        ConfigError: the parameter is not set, or the file is not usable.
    """
    path = read_described(node, "scenario", "")
    if not path:
        raise ConfigError(
            "parameter scenario is not set: add --ros-args -p scenario:=<path of a scenario file>"
        )
    return load_scenario(path)


def read_observers(node: Node) -> tuple[str, ...]:
    """Names of the nodes that the parameter ``observers`` adds to the barrier."""
    return tuple(name for name in read_described(node, "observers", [""]) if name)


def warn_of_unknown(node: Node) -> None:
    """Print a warning for each given parameter that the node has not declared.

    It is no error: a section ``/**`` of a file is for several nodes, and not each has all its parameters.
    """
    known = node.list_parameters([], 0).names
    for name in sorted(set(_given(node)) - set(known)):
        meant = did_you_mean(name, known)
        print(
            f"{node.get_fully_qualified_name()}: warning: unknown parameter {name} is ignored{meant}",
            file=sys.stderr,
        )


def _given(node: Node) -> Mapping[str, Parameter]:
    """Parameters of a node on the command line and in its files; rclpy has no public name for them."""
    given: Mapping[str, Parameter] = node._parameter_overrides
    return given
