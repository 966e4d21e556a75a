"""The node of a vehicle with a link that delays both directions, run as a program by a test."""

import sys
from functools import partial
from pathlib import Path

import rclpy

sys.path.insert(0, str(Path(__file__).parents[1]))

from relform_core.names import VEHICLE_NODE
from relform_ros.run_node import run_node
from relform_sim.nodes.quadrotor import build_quadrotor
from support.links import delayed_link

if __name__ == "__main__":
    build = partial(build_quadrotor, make_link=delayed_link)
    sys.exit(run_node(lambda: rclpy.create_node(VEHICLE_NODE), build))
