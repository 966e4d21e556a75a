"""Nodes in the process of a test that leave nothing behind in their ROS domain."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

import rclpy
from rclpy.context import Context
from rclpy.node import Node

from relform_core.names import split_node_name
from relform_ros.spinner import Logic


@contextmanager
def node_maker(domain_id: int | None = None) -> Iterator[Callable[[str], Node]]:
    """Makes nodes by their full names, and destroys them at the end.

    A node that is only dropped stays visible to later tests in its domain until it is garbage-collected. So
    does one in an executor, until that is shut down.

    Args:
        domain_id: None: that of the environment.
    """
    context = Context()
    rclpy.init(context=context, domain_id=domain_id)
    nodes: list[Node] = []

    def make(full_name: str) -> Node:
        namespace, name = split_node_name(full_name)
        nodes.append(rclpy.create_node(name, namespace=namespace, context=context))
        return nodes[-1]

    try:
        yield make
    finally:
        for node in nodes:
            node.destroy_node()
        rclpy.shutdown(context=context)


def run_without_waiting(logic: Logic) -> None:
    """Run the logic of a node to its end, without callbacks; it must not wait."""
    with suppress(StopIteration):
        raise AssertionError(f"waits for at most {logic.send(None).poll_s} s")
