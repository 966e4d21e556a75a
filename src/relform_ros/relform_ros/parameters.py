"""The parameters that every node of a flight has: which scenario is flown, and who takes part."""

from pathlib import Path
from typing import TypeVar

from rcl_interfaces.msg import ParameterDescriptor
from rclpy.node import Node

from relform_core.errors import ConfigError
from relform_core.load import LoadedScenario, load_scenario

T = TypeVar("T")


def read_only(node: Node, name: str, default: T, description: str) -> T:
    """Declare a parameter that cannot be changed later, and read it."""
    node.declare_parameter(name, default, ParameterDescriptor(description=description, read_only=True))
    value: T = node.get_parameter(name).value
    return value


def read_scenario(node: Node) -> LoadedScenario:
    """Load the scenario that the parameter ``scenario`` names.

    Raises:
        ConfigError: the parameter is not set, or the file is not usable.
    """
    description = "Path of the scenario file, usually the effective configuration in a run folder."
    path = read_only(node, "scenario", "", description)
    if not path:
        raise ConfigError(
            "parameter scenario is not set: add --ros-args -p scenario:=<path of a scenario file>"
        )
    return load_scenario(Path(path))


def read_observers(node: Node) -> tuple[str, ...]:
    """Names of the nodes that the parameter ``observers`` adds to the barrier."""
    description = (
        "Fully qualified names of the nodes for which every step waits, beside vehicles and controller."
    )
    return tuple(name for name in read_only(node, "observers", [""], description) if name)
