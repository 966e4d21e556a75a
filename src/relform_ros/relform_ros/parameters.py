"""The parameters that every node of a flight has: which scenario is flown, and who takes part."""

from pathlib import Path

from rcl_interfaces.msg import ParameterDescriptor
from rclpy.node import Node

from relform_core.errors import ConfigError
from relform_core.load import LoadedScenario, load_scenario


def read_scenario(node: Node) -> LoadedScenario:
    """Load the scenario that the parameter ``scenario`` names.

    Raises:
        ConfigError: the parameter is not set, or the file is not usable.
    """
    description = "Path of the scenario file, usually the effective configuration in a run folder."
    node.declare_parameter("scenario", "", ParameterDescriptor(description=description, read_only=True))
    path = node.get_parameter("scenario").value
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
    node.declare_parameter("observers", [""], ParameterDescriptor(description=description, read_only=True))
    return tuple(name for name in node.get_parameter("observers").value if name)
