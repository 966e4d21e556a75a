"""Names of nodes and topics."""

import pytest

from relform_core.names import split_node_name, step_done_topic, vehicle_node, vehicle_topic


def test_names_of_a_vehicle() -> None:
    assert vehicle_node("follower_1") == "/follower_1/quadrotor"
    assert vehicle_topic("follower_1", "imu") == "/follower_1/imu"
    assert step_done_topic(vehicle_node("follower_1")) == "/follower_1/quadrotor/step_done"


@pytest.mark.parametrize(
    ("node", "namespace", "name"),
    [("/sim/clock", "/sim", "clock"), ("/recorder", "/", "recorder"), ("/a/b/node", "/a/b", "node")],
)
def test_namespace_and_base_name(node: str, namespace: str, name: str) -> None:
    assert split_node_name(node) == (namespace, name)
