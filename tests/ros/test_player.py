"""The player in a process of its own, heard by subscriptions of this one."""

import contextlib
import os
import pty
import subprocess
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
import rclpy
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Imu

from relform_tools.bag_reader import BagMessage, find_bag, read_bag

WORKSPACE = Path(__file__).parents[2]
SHORT_FLIGHT = WORKSPACE / "tests/data/short_flight"
PLAYER = WORKSPACE / "install/relform_tools/lib/relform_tools/player"
STEPS, TICKS = 40, 41
DEEP = QoSProfile(depth=1000, durability=DurabilityPolicy.TRANSIENT_LOCAL)
"""Gets what was published before it was discovered, too."""


class Listener:
    """Hears the ticks and one sensor, in the order of their arrival."""

    def __init__(self, node: Node) -> None:
        self.ticks: list[int] = []
        self.imu: list[int] = []
        self._executor = EventsExecutor(context=node.context)
        self._executor.add_node(node)
        node.create_subscription(Clock, "/clock", self._on_clock, DEEP)
        node.create_subscription(Imu, "/follower_1/imu", self._on_imu, DEEP)

    def _on_clock(self, msg: Clock) -> None:
        self.ticks.append(msg.clock.sec * 1_000_000_000 + msg.clock.nanosec)

    def _on_imu(self, msg: Imu) -> None:
        self.imu.append(msg.header.stamp.sec * 1_000_000_000 + msg.header.stamp.nanosec)

    def hear(self, until: Callable[[], bool], at_most_s: float = 30.0) -> None:
        deadline = time.monotonic() + at_most_s
        while not until() and time.monotonic() < deadline:
            self._executor.spin_once(timeout_sec=0.02)


@pytest.fixture
def listener() -> Iterator[Listener]:
    context = rclpy.Context()
    rclpy.init(context=context)
    node = rclpy.create_node("listener", context=context)
    yield Listener(node)
    node.destroy_node()
    rclpy.shutdown(context=context)


Start = Callable[..., subprocess.Popen[str]]


@pytest.fixture
def player() -> Iterator[Start]:
    """Starts a player; it ends with the test."""
    with contextlib.ExitStack() as stack:

        def start(*parameters: str, stdin: int = subprocess.DEVNULL) -> subprocess.Popen[str]:
            arguments = [word for parameter in parameters for word in ("-p", parameter)]
            command = [str(PLAYER), "--ros-args", "-p", "wait_s:=30.0", *arguments]
            process = subprocess.Popen(command, text=True, stderr=subprocess.PIPE, stdin=stdin)
            stack.enter_context(process)
            stack.callback(process.kill)
            return process

        yield start


@pytest.mark.parametrize("rate", [0.5, 1.0, 5.0])
def test_every_message_comes_once_and_in_order_at_any_rate(
    listener: Listener, player: Start, rate: float
) -> None:
    process = player(f"bag:={SHORT_FLIGHT}", "topics:=['/clock', '/follower_1/imu']", f"rate:={rate}")
    listener.hear(until=lambda: process.poll() is not None)
    listener.hear(until=lambda: len(listener.ticks) >= TICKS, at_most_s=2.0)
    assert process.wait() == 0
    stamps = [step * 50_000_000 for step in range(TICKS)]
    assert listener.ticks == stamps
    assert listener.imu == stamps


def test_chosen_topics_from_an_offset_on(listener: Listener, player: Start) -> None:
    process = player(
        f"bag:={SHORT_FLIGHT}", "topics:=['/follower_1/imu']", "start_offset_s:=1.5", "rate:=10.0"
    )
    listener.hear(until=lambda: process.poll() is not None)
    listener.hear(until=lambda: len(listener.imu) >= 11, at_most_s=2.0)
    assert listener.imu == [step * 50_000_000 for step in range(30, TICKS)]
    assert listener.ticks == []


def test_keys_pause_step_and_go_on(listener: Listener, player: Start) -> None:
    terminal, keyboard = pty.openpty()
    process = player(
        f"bag:={SHORT_FLIGHT}", "topics:=['/clock']", "start_paused:=true", "rate:=10.0", stdin=keyboard
    )
    listener.hear(until=lambda: bool(listener.ticks), at_most_s=4.0)
    assert listener.ticks == [], "paused from the start"
    for ticks in (1, 2):
        os.write(terminal, b"\x1b[C")
        listener.hear(until=lambda ticks=ticks: len(listener.ticks) >= ticks)  # type: ignore[misc]  # of now
        listener.hear(until=lambda ticks=ticks: len(listener.ticks) > ticks, at_most_s=0.3)  # type: ignore[misc]
        assert len(listener.ticks) == ticks, "one message for each key"
    os.write(terminal, b" ")
    listener.hear(until=lambda: process.poll() is not None)
    listener.hear(until=lambda: len(listener.ticks) >= TICKS, at_most_s=2.0)
    assert len(listener.ticks) == TICKS
    os.close(terminal)
    os.close(keyboard)


def test_it_repeats_until_it_is_told_to_end(listener: Listener, player: Start) -> None:
    process = player(f"bag:={SHORT_FLIGHT}", "topics:=['/clock']", "loop:=true", "rate:=50.0")
    listener.hear(until=lambda: len(listener.ticks) > 2 * TICKS)
    process.terminate()
    assert process.wait(timeout=5.0) == 130
    assert listener.ticks[:TICKS] == listener.ticks[TICKS : 2 * TICKS]


@pytest.mark.parametrize(
    ("parameters", "problem"),
    [
        ((), "parameter bag is not set"),
        (("bag:=nowhere",), "nowhere: no such file or folder"),
        ((f"bag:={SHORT_FLIGHT}", "rate:=0.0"), "rate must be between"),
        ((f"bag:={SHORT_FLIGHT}", "topics:=['/nothing']"), "no topic /nothing; recorded are"),
        ((f"bag:={SHORT_FLIGHT}", "start_offset_s:=9.0"), "nothing to play after 9.0 s"),
        ((f"bag:={SHORT_FLIGHT}", "rate:=fast"), "rate"),
    ],
)
def test_bad_input_is_one_line(player: Start, parameters: tuple[str, ...], problem: str) -> None:
    _, errors = player(*parameters).communicate(timeout=20.0)
    (line,) = errors.splitlines()
    assert problem in line


def test_the_bag_holds_what_is_expected_of_it() -> None:
    messages = [entry for entry in read_bag(find_bag(SHORT_FLIGHT)) if isinstance(entry, BagMessage)]
    assert sum(message.topic == "/clock" for message in messages) == TICKS
