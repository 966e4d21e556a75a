"""All nodes of a flight in one process.

They exchange messages without transport (``relform_ros.intra_process``), and publish them for all others.
"""

from collections.abc import Sequence

import rclpy
from rclpy.node import Node

from relform_bags.nodes.recorder import build_recorder, create_recorder
from relform_bringup.nodes.monitor import build_remote_monitor, create_monitor
from relform_controller.blas import one_blas_thread
from relform_controller.nodes.controller import build_controller
from relform_core.names import MONITOR_NODE, RECORDER_NODE, VEHICLE_NODE, split_node_name
from relform_core.roster import Roster
from relform_ros.parameters import read_observers, read_scenario
from relform_ros.run_node import Build, run_nodes
from relform_sim.nodes.clock import EXIT_CODES, ClockServer, create_clock
from relform_sim.nodes.quadrotor import build_quadrotor


def create_nodes() -> Sequence[tuple[Node, Build]]:
    """Clock, quadrotors, controllers and those of our observers that are asked for, by their parameters.

    Raises:
        ConfigError: the parameter ``scenario`` is missing or not usable.
    """
    clock = create_clock()
    roster = Roster.of(read_scenario(clock).config)
    nodes: list[tuple[Node, Build]] = [(clock, ClockServer)]
    observers = read_observers(clock)
    # Observers start first, because they miss what is sent earlier.
    if RECORDER_NODE in observers:
        nodes.insert(0, (create_recorder(), build_recorder))
    if MONITOR_NODE in observers:
        nodes.insert(0, (create_monitor(), build_remote_monitor))
    for vehicle in roster.vehicles:
        nodes.append((rclpy.create_node(VEHICLE_NODE, namespace=f"/{vehicle}"), build_quadrotor))
    for controller in roster.controllers:
        namespace, name = split_node_name(controller.node)
        nodes.append((rclpy.create_node(name, namespace=namespace), build_controller))
    return nodes


def main() -> int:
    """Run the nodes."""
    with one_blas_thread():
        return run_nodes(create_nodes, EXIT_CODES)
