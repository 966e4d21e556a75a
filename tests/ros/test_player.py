"""The player in a process of its own; this process subscribes to its topics."""

import contextlib
import os
import pty
import subprocess
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Imu

from relform_bags.nodes.playback_check import check_playback
from relform_bags.reader import BagMessage, bag_files, read_bag
from relform_bags.split_limits import SplitLimits
from relform_bags.writer import BagWriter
from support.bags import header
from support.ros_nodes import node_maker

WORKSPACE = Path(__file__).parents[2]
SHORT_FLIGHT = WORKSPACE / "tests/data/short_flight"
PLAYER = WORKSPACE / "install/relform_bags/lib/relform_bags/player"
STEPS, TICKS = 40, 41
DEEP = QoSProfile(depth=1000, durability=DurabilityPolicy.TRANSIENT_LOCAL)
"""Also gets the messages that were published before discovery."""


class Listener:
    """Collects the ticks and the stamps of one sensor, in the order of arrival."""

    def __init__(self, node: Node) -> None:
        self.ticks: list[int] = []
        self.imu: list[int] = []
        self._executor = EventsExecutor(context=node.context)
        self._executor.add_node(node)
        node.create_subscription(Clock, "/clock", self._on_clock, DEEP)
        node.create_subscription(Imu, "/follower_1/imu", self._on_imu, DEEP)

    def close(self) -> None:
        self._executor.shutdown()

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
    with node_maker() as make:
        listener = Listener(make("/listener"))
        yield listener
        listener.close()


Start = Callable[..., subprocess.Popen[str]]


@pytest.fixture
def player() -> Iterator[Start]:
    """Starts a player, which is stopped after the test."""
    with contextlib.ExitStack() as stack:

        def start(*parameters: str, stdin: int = subprocess.DEVNULL) -> subprocess.Popen[str]:
            arguments = [word for parameter in parameters for word in ("-p", parameter)]
            command = [str(PLAYER), "--ros-args", "-p", "wait_s:=30.0", *arguments]
            process = subprocess.Popen(command, text=True, stderr=subprocess.PIPE, stdin=stdin)
            stack.enter_context(process)
            stack.callback(process.kill)
            return process

        yield start


@pytest.mark.parametrize("rate", [0.2, 1.0, 5.0])
def test_every_message_arrives_once_in_order_and_in_time(rate: float) -> None:
    check = check_playback(SHORT_FLIGHT, rate)
    assert len(check.expected) == 1164
    assert check.is_complete
    delay = check.delay  # relative to the first message, which may be late, too
    assert delay.min() > -0.02
    assert np.median(delay) < 0.02


def test_split_bag_plays_as_one(tmp_path: Path) -> None:
    limits = SplitLimits(duration_s=1)
    with BagWriter(tmp_path / "bag", {}, limits) as writer:
        writer.add_topic("/tick", "std_msgs/msg/Header", [])
        for step in range(45):
            writer.write("/tick", header(step), step * 100_000_000, 0)
    assert len(bag_files(tmp_path / "bag")) == 5
    check = check_playback(tmp_path / "bag", 5.0)
    assert len(check.expected) == 45
    assert check.is_complete


def test_chosen_topics_from_an_offset_on(listener: Listener, player: Start) -> None:
    process = player(
        f"bag:={SHORT_FLIGHT}", "topics:=['/follower_1/imu']", "start_offset_s:=1.5", "rate:=10.0"
    )
    listener.hear(until=lambda: process.poll() is not None)
    listener.hear(until=lambda: len(listener.imu) >= 11, at_most_s=2.0)
    assert listener.imu == [step * 50_000_000 for step in range(30, TICKS)]
    assert listener.ticks == []


def test_keys_pause_step_and_resume(listener: Listener, player: Start) -> None:
    terminal, keyboard = pty.openpty()
    process = player(
        f"bag:={SHORT_FLIGHT}", "topics:=['/clock']", "start_paused:=true", "rate:=10.0", stdin=keyboard
    )
    listener.hear(until=lambda: bool(listener.ticks), at_most_s=4.0)
    assert listener.ticks == [], "paused from the start"
    for ticks in (1, 2):
        os.write(terminal, b"\x1b[C")
        listener.hear(until=lambda ticks=ticks: len(listener.ticks) >= ticks)
        listener.hear(until=lambda ticks=ticks: len(listener.ticks) > ticks, at_most_s=0.3)
        assert len(listener.ticks) == ticks, "one message for each key"
    os.write(terminal, b" ")
    listener.hear(until=lambda: process.poll() is not None)
    listener.hear(until=lambda: len(listener.ticks) >= TICKS, at_most_s=2.0)
    assert len(listener.ticks) == TICKS
    os.close(terminal)
    os.close(keyboard)


def test_keys_change_the_rate_and_a_pause_delays_the_end(listener: Listener, player: Start) -> None:
    terminal, keyboard = pty.openpty()
    process = player(
        f"bag:={SHORT_FLIGHT}", "topics:=['/clock']", "duration_s:=0.1", "rate:=0.2", stdin=keyboard
    )
    listener.hear(until=lambda: len(listener.ticks) >= 1)
    os.write(terminal, b" " + 2 * b"\x1b[A" + 4 * b"\x1b[B" + 2 * b"\x1b[C")
    listener.hear(until=lambda: len(listener.ticks) >= 3)
    listener.hear(until=lambda: process.poll() is not None, at_most_s=0.5)
    assert process.poll() is None, "it is paused"
    os.write(terminal, b" ")
    _, errors = process.communicate(timeout=10.0)
    assert process.returncode == 0
    assert listener.ticks == [0, 50_000_000, 100_000_000]
    said = [line.partition("[player]: ")[2] for line in errors.splitlines()]
    assert said[:6] == [
        "Set rate to 0.2",
        "Adding keyboard callbacks.",
        "Press SPACE for Pause/Resume",
        "Press CURSOR_RIGHT for Play Next Message",
        "Press CURSOR_UP for Increase Rate 10%",
        "Press CURSOR_DOWN for Decrease Rate 10%",
    ]
    assert said[6:] == [
        "Pausing play.",
        *(f"Set rate to {rate}" for rate in ("0.3", "0.4", "0.3", "0.2", "0.1")),
        "Failed to set rate to invalid value 0",
        "Resuming play.",
    ]
    os.close(terminal)
    os.close(keyboard)


def test_own_clock_replaces_the_recorded_one(listener: Listener, player: Start) -> None:
    process = player(
        f"bag:={SHORT_FLIGHT}", "topics:=['/clock', '/follower_1/imu']", "clock_hz:=100.0", "delay_s:=0.3"
    )
    listener.hear(until=lambda: process.poll() is not None)
    assert process.returncode == 0
    assert len(listener.imu) == TICKS
    assert listener.ticks == sorted(listener.ticks)
    assert listener.ticks.count(0) > 3, "its time does not advance before the start"
    assert sum(tick % 50_000_000 != 0 for tick in listener.ticks) > 50
    assert listener.ticks[-1] == pytest.approx(2_000_000_000, abs=200_000_000)


def test_clock_with_each_message_of_a_topic(listener: Listener, player: Start) -> None:
    process = player(
        f"bag:={SHORT_FLIGHT}",
        "regex:='/follower_1/(imu|sonar)'",
        "exclude_regex:='.*sonar'",
        "clock_topics:=['follower_1/imu']",
        "rate:=2.0",
    )
    listener.hear(until=lambda: process.poll() is not None)
    listener.hear(until=lambda: len(listener.imu) >= TICKS, at_most_s=2.0)
    assert len(listener.imu) == TICKS
    assert len(listener.ticks) == pytest.approx(TICKS, abs=2)  # the first may be lost before discovery
    late_ns = [tick - stamp for tick, stamp in zip(listener.ticks, listener.imu, strict=False)]
    assert min(late_ns) >= 0


def test_loop_repeats_until_a_signal(listener: Listener, player: Start) -> None:
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
        ((f"bag:={SHORT_FLIGHT}", "rate:=0.0"), "rate must be above 0"),
        ((f"bag:={SHORT_FLIGHT}", "topics:=['/nothing']"), "no topic /nothing, expected one of"),
        ((f"bag:={SHORT_FLIGHT}", "start_offset_s:=9.0"), "nothing to play"),
        ((f"bag:={SHORT_FLIGHT}", "rate:=fast"), "rate"),
        ((f"bag:={SHORT_FLIGHT}", "regex:='('"), "'(' is not a valid regular expression"),
        ((f"bag:={WORKSPACE / 'README.md'}",), "README.md: not an MCAP file"),
        ((f"bag:={WORKSPACE / 'docs'}",), "docs: not a bag: the folder has no .mcap file"),
    ],
)
def test_bad_input_is_one_line(player: Start, parameters: tuple[str, ...], problem: str) -> None:
    _, errors = player(*parameters).communicate(timeout=20.0)
    assert problem in errors
    assert errors.count("\n") == 1, errors


def test_the_recorded_flight_has_all_ticks() -> None:
    messages = [entry for entry in read_bag(SHORT_FLIGHT) if isinstance(entry, BagMessage)]
    assert sum(message.topic == "/clock" for message in messages) == TICKS
