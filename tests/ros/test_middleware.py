"""The settings of the middleware have their effect (docs/decisions/0009-middleware.md)."""

import time
from collections.abc import Iterator

import pytest
from rclpy.duration import Duration
from rclpy.node import Node
from std_msgs.msg import String

from support.ros_nodes import node_maker


@pytest.fixture
def node(live_nodes: dict[str, str]) -> Iterator[Node]:
    with node_maker(int(live_nodes["ROS_DOMAIN_ID"])) as make:
        yield make("/writer")


def test_a_lost_acknowledgement_arrives_within_a_heartbeat(node: Node) -> None:
    for number in range(20):  # one in four to a newly found reader gets lost
        publisher = node.create_publisher(String, "/alpha/heard_only", 10)
        while not publisher.get_subscription_count():
            time.sleep(0.01)
        publisher.publish(String(data=f"message {number}"))
        assert publisher.wait_for_all_acked(Duration(seconds=1)), number
        node.destroy_publisher(publisher)
