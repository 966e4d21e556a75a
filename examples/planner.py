#!/usr/bin/env python3
"""A planner of one's own: takes the leader of a hovering team along a figure of eight, by the topic
/formation/trajectory.

    scripts/fly.py --scenario paper --idle          # in one terminal
    ros2 service call /formation/controller/take_off std_srvs/srv/Trigger
    examples/planner.py                             # when the team hovers

It knows nothing of relform but two topics: where the leader is asked to be, and where it shall be.
"""

import math
import sys

import rclpy
from builtin_interfaces.msg import Duration
from geometry_msgs.msg import Transform, Vector3
from rclpy.qos import QoSProfile
from trajectory_msgs.msg import MultiDOFJointTrajectory, MultiDOFJointTrajectoryPoint

from relform_msgs.msg import FormationReference

WIDTH_M, HEIGHT_M = 4.0, 2.0
PERIOD_S = 16.0
POINTS = 64
WAIT_S = 10.0


def figure_of_eight(x: float, y: float, z: float) -> MultiDOFJointTrajectory:
    """Once around, from a place and back to it [m]; it starts slowly and ends slowly."""
    trajectory = MultiDOFJointTrajectory()
    trajectory.header.frame_id = "map"  # stamp 0: times count from when it arrives
    for index in range(1, POINTS + 1):
        share = index / POINTS
        angle = math.tau * share * share * (3.0 - 2.0 * share)
        place = Vector3(
            x=x + 0.5 * WIDTH_M * math.sin(angle), y=y + 0.5 * HEIGHT_M * math.sin(2.0 * angle), z=z
        )
        transform = Transform(translation=place)
        transform.rotation.w = 0.0  # all zero: the leader keeps its yaw
        seconds = PERIOD_S * share
        time = Duration(sec=int(seconds), nanosec=int(seconds % 1.0 * 1e9))
        trajectory.points.append(MultiDOFJointTrajectoryPoint(transforms=[transform], time_from_start=time))
    return trajectory


def main() -> int:
    """Plan once; returns the exit code."""
    rclpy.init()
    node = rclpy.create_node("planner")
    publisher = node.create_publisher(MultiDOFJointTrajectory, "/formation/trajectory", 1)
    references: list[FormationReference] = []
    node.create_subscription(
        FormationReference, "/formation/reference", references.append, QoSProfile(depth=1)
    )
    deadline = node.get_clock().now().nanoseconds + int(WAIT_S * 1e9)
    while not references or not publisher.get_subscription_count():
        rclpy.spin_once(node, timeout_sec=0.1)
        if node.get_clock().now().nanoseconds > deadline:
            print(f"error: no team flies: /formation/reference is silent for {WAIT_S:g} s", file=sys.stderr)
            return 1
    place = references[-1].leader_position
    publisher.publish(figure_of_eight(place.x, place.y, place.z))
    publisher.wait_for_all_acked()
    return 0


if __name__ == "__main__":
    sys.exit(main())
