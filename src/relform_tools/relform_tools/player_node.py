"""Plays a bag: every message on its topic again, in its order and at its time."""

import sys
import time
from pathlib import Path
from typing import TypeVar

import rclpy
from rcl_interfaces.msg import ParameterDescriptor
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

from relform_core.errors import BagError, ConfigError
from relform_core.units import NANOSECONDS_PER_SECOND
from relform_ros.run_node import Spinner, run_node
from relform_tools.bag_reader import BagMessage, find_bag, read_bag
from relform_tools.bag_types import message_class
from relform_tools.keyboard import Keyboard, terminal_keyboard
from relform_tools.playback import PlaybackOptions, Timeline

KEY_LATENCY_S = 0.05
RATE_STEP = 1.1
FAREWELL_S = 2.0
"""How long the last messages may take to be acknowledged."""
QOS = QoSProfile(
    depth=1000, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.TRANSIENT_LOCAL
)
"""Serves every subscription, best effort and volatile ones too; late ones get what was published before."""
HELP = "space: pause, right: next message while paused, up and down: rate, Ctrl-C: end"


class Player:
    """Publishes the messages of a bag."""

    def __init__(self, node: Node, spinner: Spinner) -> None:
        self._node = node
        self._spinner = spinner
        bag = _parameter(node, "bag", "", "Bag to play: its file, its folder or the folder of a run.")
        if not bag:
            raise ConfigError("parameter bag is not set: add --ros-args -p bag:=<bag or folder of a run>")
        topics = _parameter(node, "topics", [""], "Topics to play; empty: all.")
        self._options = PlaybackOptions(
            rate=_parameter(node, "rate", 1.0, "Bag time per wall time."),
            start_offset=_parameter(node, "start_offset_s", 0.0, "Bag time to skip at the start [s]."),
            loop=_parameter(node, "loop", False, "Start again at the end."),
            start_paused=_parameter(node, "start_paused", False, "Wait for the space key."),
        )
        self._wait_max = _parameter(
            node, "wait_s", 1.0, "Wall time that subscribers of all topics may take to be found [s]."
        )
        chosen = {topic for topic in topics if topic}
        self._messages = _load(Path(bag), chosen, self._options.start_offset)
        # Remappings on the command line hold for these names as for any other.
        self._publishers: dict[str, Publisher] = {
            topic: node.create_publisher(message_class(type_name), topic, QOS)
            for topic, type_name in {message.topic: message.type_name for message in self._messages}.items()
        }

    def run(self) -> None:
        """Play to the end, or until a signal arrives."""
        self._await_subscribers()
        first_ns = self._messages[0].log_time_ns
        with terminal_keyboard() as keyboard:
            if sys.stdin.isatty():
                print(HELP, flush=True)
            timeline = Timeline(first_ns, self._options.rate, time.monotonic(), self._options.start_paused)
            while True:
                for message in self._messages:
                    self._wait(message.log_time_ns, timeline, keyboard)
                    self._publishers[message.topic].publish(message.data)
                if not self._options.loop:
                    break
                timeline.jump(first_ns, time.monotonic())
        for publisher in self._publishers.values():
            publisher.wait_for_all_acked(rclpy.duration.Duration(seconds=FAREWELL_S))

    def _await_subscribers(self) -> None:
        """Give those who are there the time to be found, so that they hear the first messages too."""
        deadline = time.monotonic() + self._wait_max
        while time.monotonic() < deadline and not all(
            publisher.get_subscription_count() for publisher in self._publishers.values()
        ):
            self._spinner.once(KEY_LATENCY_S)

    def _wait(self, bag_time_ns: int, timeline: Timeline, keyboard: Keyboard) -> None:
        """Return when a bag time has come, or the message at it was asked for."""
        while (left := timeline.wait_for(bag_time_ns, time.monotonic())) is None or left > 0.0:
            self._spinner.once(KEY_LATENCY_S if left is None else min(left, KEY_LATENCY_S))
            match keyboard.pressed():
                case "space":
                    timeline.toggle_pause(time.monotonic())
                case "up":
                    timeline.set_rate(timeline.rate * RATE_STEP, time.monotonic())
                case "down":
                    timeline.set_rate(timeline.rate / RATE_STEP, time.monotonic())
                case "right" if timeline.paused:
                    timeline.jump(bag_time_ns, time.monotonic())
                    return


def _load(path: Path, chosen: set[str], start_offset: float) -> list[BagMessage]:
    """The messages to play, by log time; those of one instant in the order of their recording.

    Raises:
        BagError: one line: there is no such bag, or nothing in it to play.
    """
    file = find_bag(path)
    messages = [entry for entry in read_bag(file) if isinstance(entry, BagMessage)]
    if not messages:
        raise BagError(f"{file}: there is no message in it")
    recorded = {message.topic for message in messages}
    if unknown := sorted(chosen - recorded):
        raise BagError(f"{file}: no topic {unknown[0]}; recorded are {', '.join(sorted(recorded))}")
    messages.sort(key=lambda message: message.log_time_ns)
    start_ns = messages[0].log_time_ns + round(start_offset * NANOSECONDS_PER_SECOND)
    selected = [
        message
        for message in messages
        if message.log_time_ns >= start_ns and (not chosen or message.topic in chosen)
    ]
    if not selected:
        raise BagError(f"{file}: nothing to play after {start_offset} s")
    return selected


T = TypeVar("T")


def _parameter(node: Node, name: str, default: T, description: str) -> T:
    node.declare_parameter(name, default, ParameterDescriptor(description=description, read_only=True))
    value: T = node.get_parameter(name).value
    return value


def main() -> int:
    """Run the node."""
    return run_node(lambda: rclpy.create_node("player"), Player)
