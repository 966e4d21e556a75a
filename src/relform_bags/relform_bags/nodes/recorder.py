"""The node ``recorder``: it records a flight, as a member of its barrier, or the topics that it discovers."""

from collections.abc import Sequence

import rclpy
from rclpy.node import Node

from relform_bags.nodes.flight_recorder import FlightRecorder
from relform_bags.nodes.topic_recorder import TopicRecorder
from relform_core.names import RECORDER_NODE, split_node_name
from relform_core.roster import Roster
from relform_ros.make_pacing import make_pacing
from relform_ros.parameters import read_observers, read_scenario
from relform_ros.run_node import Runnable, run_node
from relform_ros.spinner import Spinner


def build_recorder(node: Node, spinner: Spinner) -> Runnable:
    """A recorder of a flight if the parameter ``observers`` names this node, otherwise one of topics.

    Raises:
        ConfigError: a parameter is missing or not usable.
    """
    observers = read_observers(node)
    if node.get_fully_qualified_name() in observers:
        scenario = read_scenario(node)
        pacing = make_pacing(node, spinner, scenario, Roster.of(scenario.config, observers))
        return FlightRecorder(node, spinner, scenario, pacing)
    return TopicRecorder(node, spinner)


def create_recorder() -> Node:
    """The node, without its logic."""
    return rclpy.create_node(split_node_name(RECORDER_NODE)[1], enable_rosout=False)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the node; its command line is that of the process unless it is given."""
    return run_node(create_recorder, build_recorder, arguments=arguments)
