"""No message is missed, whether the executor notices it or not."""

import time
from collections.abc import Iterator
from typing import Any

import pytest
from rclpy.node import Node
from std_msgs.msg import Header

from relform_ros import run_node
from relform_ros.qos import LATCHED, LOCKSTEP
from relform_ros.raw import raw_stamp_ns, subscribe_raw
from relform_ros.run_node import Spinner
from support.ros_nodes import node_maker

SECONDS = [3, 4, 5]


class DeafExecutor:
    """Misses every message, as the EventsExecutor misses those that arrive while it registers."""

    def __init__(self, **_: Any) -> None:
        pass

    def add_node(self, node: Node) -> None:
        pass

    def spin_once(self, timeout_sec: float) -> None:
        time.sleep(timeout_sec)

    def shutdown(self) -> None:
        pass


@pytest.fixture
def node() -> Iterator[Node]:
    with node_maker() as make:
        yield make("/reads_and_writes")


@pytest.mark.parametrize("deaf", [True, False])
def test_every_message_is_taken_once(deaf: bool, node: Node, monkeypatch: pytest.MonkeyPatch) -> None:
    if deaf:
        monkeypatch.setattr(run_node, "EventsExecutor", DeafExecutor)
    spinner = Spinner(node)
    decoded, raw = [], []
    node.create_subscription(Header, "/decoded", lambda msg: decoded.append(msg.stamp.sec), LATCHED)
    subscribe_raw(node, Header, "/raw", lambda data, _: raw.append(raw_stamp_ns(data)), LATCHED)
    publishers = [node.create_publisher(Header, topic, LATCHED) for topic in ("/decoded", "/raw")]
    for sec in SECONDS:
        message = Header(frame_id="W")
        message.stamp.sec = sec
        for publisher in publishers:
            publisher.publish(message)
        spinner.until(lambda: decoded[-1:] == [sec] and raw[-1:] == [sec * 1_000_000_000])  # noqa: B023
    spinner.drain(0.3)
    assert decoded == SECONDS
    assert raw == [sec * 1_000_000_000 for sec in SECONDS]


def test_error_of_a_missed_callback_is_raised(node: Node, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(_: Header) -> None:
        raise ValueError("of the callback")

    monkeypatch.setattr(run_node, "EventsExecutor", DeafExecutor)
    spinner = Spinner(node)
    node.create_subscription(Header, "/decoded", fail, LATCHED)
    node.create_publisher(Header, "/decoded", LATCHED).publish(Header())
    with pytest.raises(ValueError, match="of the callback"):
        spinner.until(lambda: False)


def test_events_that_are_not_messages_are_left_to_the_executor(node: Node) -> None:
    """A reader that a writer cannot serve is an event, and only one waiter can take it."""
    spinner = Spinner(node)
    topics = [f"/volatile_{number}" for number in range(5)]
    writers = [node.create_publisher(Header, topic, LOCKSTEP) for topic in topics]
    spinner.drain(0.1)
    for topic in topics:
        node.create_subscription(Header, topic, lambda _: None, LATCHED)
    spinner.drain(0.3)
    assert [writer.get_subscription_count() for writer in writers] == [0] * len(writers)
