"""Nodes of one process take turns, and no message is missed, whether the executor notices it or not."""

import time
from collections.abc import Iterator
from typing import Any

import pytest
from rclpy.node import Node
from std_msgs.msg import Header

from relform_ros import spinner as spinning
from relform_ros.intra_process import IntraProcess
from relform_ros.qos import LATCHED, LOCKSTEP
from relform_ros.raw import raw_stamp_ns, subscribe_raw
from relform_ros.spinner import Spinner, StopRequestedError, until
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
        monkeypatch.setattr(spinning, "EventsExecutor", DeafExecutor)
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
        while not (decoded[-1:] == [sec] and raw[-1:] == [sec * 1_000_000_000]):
            spinner.once()
    spinner.drain(0.3)
    assert decoded == SECONDS
    assert raw == [sec * 1_000_000_000 for sec in SECONDS]


def test_error_of_a_missed_callback_is_raised(node: Node, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(_: Header) -> None:
        raise ValueError("of the callback")

    async def forever() -> None:
        await until(lambda: False)

    monkeypatch.setattr(spinning, "EventsExecutor", DeafExecutor)
    spinner = Spinner(node)
    node.create_subscription(Header, "/decoded", fail, LATCHED)
    node.create_publisher(Header, "/decoded", LATCHED).publish(Header())
    with pytest.raises(ValueError, match="of the callback"):
        spinner.run([forever()])


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


def test_logic_that_waits_lets_others_continue(node: Node) -> None:
    turns: list[str] = []

    async def logic(name: str, first: int, last: int) -> None:
        for number in range(last + 1):
            await until(lambda: len(turns) == 2 * number + first)  # noqa: B023  # not called later
            turns.append(f"{name}{number}")

    Spinner(node).run([logic("a", 0, 3), logic("b", 1, 2)])
    assert turns == ["a0", "b0", "a1", "b1", "a2", "b2", "a3"]


def test_callbacks_run_while_one_logic_never_waits_long(node: Node) -> None:
    """Two nodes that only exchange messages with each other still answer requests."""
    spinner, steps, answers = Spinner(node), [0, 0], []
    node.create_timer(0.001, lambda: answers.append(steps[0]))

    async def logic(own: int, other: int) -> None:
        while not answers:
            await until(lambda: steps[own] <= steps[other] or bool(answers))
            steps[own] += 1

    spinner.run([logic(0, 1), logic(1, 0)])
    assert answers[0] > 0


def test_error_in_a_wait_is_raised_there_and_ends_the_others(node: Node) -> None:
    ends: list[str] = []

    def fail() -> bool:
        raise ValueError("of the condition")

    async def failing() -> None:
        try:
            await until(fail)
        except ValueError as error:
            ends.append(f"failed: {error}")
            raise

    async def waiting() -> None:
        try:
            await until(lambda: False)
        finally:
            ends.append("closed")

    with pytest.raises(ValueError, match="of the condition"):
        Spinner(node).run([waiting(), failing()])
    assert ends == ["failed: of the condition", "closed"]


def test_signal_ends_the_waiting(node: Node) -> None:
    spinner = Spinner(node)

    async def logic() -> None:
        spinner.interrupt()
        await until(lambda: False)

    with pytest.raises(StopRequestedError):
        spinner.run([logic()])


def test_only_topics_of_one_process_are_handed_over() -> None:
    process = IntraProcess(["/a", "/b"])
    assert process.exchanges(["/a"])
    assert process.exchanges(["/b", "/a"])
    assert not process.exchanges(["/a", "/c"])
    taken: list[Any] = []
    process.subscribe("/x", taken.append)
    process.subscribe_raw("/y", lambda data, publish_time_ns: taken.append(data))
    assert [topic for topic in ("/x", "/y") if process.wants_serialized(topic)] == ["/y"]
    process.publish("/x", "of x", b"")
    process.publish("/y", "of y", b"data of y")
    process.publish("/z", "of z", b"")
    assert taken == ["of x", b"data of y"]


def test_readers_of_one_process_take_the_content_if_the_writer_gives_it() -> None:
    process, taken = IntraProcess(["/a"]), list[str]()
    process.subscribe("/x", lambda message: taken.append(f"decoded {message}"), taken.append)
    process.subscribe("/x", lambda message: taken.append(f"read {message}"))
    process.publish("/x", "message 1", b"", "content 1")
    process.publish("/x", "message 2", b"")
    assert taken == ["content 1", "read message 1", "decoded message 2", "read message 2"]
