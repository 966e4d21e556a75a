"""The node ``player``: publishes the messages of a bag again, in their order and at their times."""

import time
from collections.abc import Sequence
from pathlib import Path

import rclpy
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rosgraph_msgs.msg import Clock as ClockMsg

from relform_bags.from_bag import as_installed
from relform_bags.keyboard import Keyboard, terminal_keyboard
from relform_bags.message_types import message_class
from relform_bags.nodes.option_parameters import read_options
from relform_bags.options import PlayerOptions
from relform_bags.reader import BagMessage, find_bag, read_bag
from relform_bags.timeline import Timeline
from relform_core.errors import BagError, ConfigError
from relform_core.names import CLOCK, PLAYER_NODE, split_node_name
from relform_ros.fields import stamp_to_msg
from relform_ros.run_node import run_node
from relform_ros.spinner import Spinner

KEY_LATENCY_S = 0.05
RATE_STEP = 0.1
QOS = QoSProfile(
    depth=1000, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.TRANSIENT_LOCAL
)
"""Serves every subscription, also best-effort and volatile ones; late ones get the messages before."""
CLOCK_QOS = QoSProfile(
    depth=10, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.TRANSIENT_LOCAL
)
"""As ``QOS``; a late subscription needs only the newest ticks."""
KEYS = {
    "SPACE": "Pause/Resume",
    "CURSOR_RIGHT": "Play Next Message",
    "CURSOR_UP": "Increase Rate 10%",
    "CURSOR_DOWN": "Decrease Rate 10%",
}
"""Actions by key, in the words of rosbag2."""


class Player:
    """Publishes the messages of a bag."""

    def __init__(self, node: Node, spinner: Spinner) -> None:
        self._node = node
        self._spinner = spinner
        self._options = read_options(node, PlayerOptions)
        if not self._options.bag:
            raise ConfigError("parameter bag is not set: add --ros-args -p bag:=<bag or folder of a run>")
        self._start_ns, self._messages = _load(self._options)
        self._publishers = self._create_publishers()
        self._messages = [
            as_installed(message) for message in self._messages if message.topic in self._publishers
        ]
        if not self._messages:
            raise BagError(f"{self._options.bag}: none of its message types is installed")
        self._timeline = Timeline(self._start_ns, self._options.rate, 0.0, paused=True)  # run() starts it
        self._last_turn = 0.0
        self._clock_before = {topic for topic in self._publishers if self._options.has_clock_before(topic)}
        self._clock = self._create_clock()

    async def run(self) -> None:
        """Play to the end, or until a signal arrives."""
        with terminal_keyboard(self._options.keyboard) as keyboard:
            self._log(f"Set rate to {self._options.rate:g}")
            if keyboard.is_connected:
                self._log("Adding keyboard callbacks.")
                for key, action in KEYS.items():
                    self._log(f"Press {key} for {action}")
            self._await_subscribers()
            self._delay(keyboard)
            self._timeline = Timeline(
                self._start_ns, self._options.rate, time.monotonic(), self._options.start_paused
            )
            self._play(keyboard)
            while self._options.loop:
                self._delay(keyboard)
                self._timeline.jump(self._start_ns, time.monotonic())
                self._play(keyboard)
        limit = Duration(seconds=self._options.ack_wait_s if self._options.ack_wait_s > 0.0 else -1.0)
        for publisher in self._publishers.values():
            if not publisher.wait_for_all_acked(limit):
                self._node.get_logger().error(f"the last messages on {publisher.topic_name} did not arrive")

    def _create_publishers(self) -> dict[str, Publisher]:
        """By topic; remappings on the command line apply to these names, too."""
        publishers = {}
        for topic, type_name in {message.topic: message.type_name for message in self._messages}.items():
            try:
                publishers[topic] = self._node.create_publisher(message_class(type_name), topic, QOS)
            except BagError as error:
                self._node.get_logger().warning(f"Ignoring a topic '{topic}', reason: {error}.")
        return publishers

    def _create_clock(self) -> Publisher | None:
        """The publisher of the player's own /clock, if it has one."""
        frequency = self._options.clock_hz
        if frequency <= 0.0 and not self._clock_before:
            return None
        publisher = self._node.create_publisher(ClockMsg, CLOCK, CLOCK_QOS)
        if frequency > 0.0:
            steady = Clock(clock_type=ClockType.STEADY_TIME)
            self._node.create_timer(1.0 / frequency, self._tick, clock=steady)
        return publisher

    def _tick(self) -> None:
        """Publish the current bag time."""
        assert self._clock is not None
        self._clock.publish(ClockMsg(clock=stamp_to_msg(self._timeline.bag_time_ns(time.monotonic()))))

    def _await_subscribers(self) -> None:
        """Wait until every topic, also /clock, has a subscriber, so that those hear the first messages."""
        publishers = [*self._publishers.values()]
        if self._clock is not None:
            publishers.append(self._clock)
        deadline = time.monotonic() + self._options.wait_s
        while time.monotonic() < deadline and not all(each.get_subscription_count() for each in publishers):
            self._spinner.once(KEY_LATENCY_S)

    def _delay(self, keyboard: Keyboard) -> None:
        deadline = time.monotonic() + self._options.delay_s
        while (left := deadline - time.monotonic()) > 0.0:
            self._turn(left, keyboard)

    def _play(self, keyboard: Keyboard) -> None:
        """Play all messages once; a pause after the last one delays the end."""
        for message in self._messages:
            self._wait_until(message.log_time_ns, keyboard)
            if message.topic in self._clock_before:
                self._tick()
            self._publishers[message.topic].publish(message.data)
        while self._timeline.paused:
            self._turn(KEY_LATENCY_S, keyboard)

    def _wait_until(self, bag_time_ns: int, keyboard: Keyboard) -> None:
        """Return when a bag time has come, or when a key asks for the message at that time."""
        while (left := self._timeline.wait_for(bag_time_ns, time.monotonic())) is None or left > 0.0:
            if self._turn(KEY_LATENCY_S if left is None else left, keyboard) == "right":
                self._timeline.jump(bag_time_ns, time.monotonic())
                return
        if time.monotonic() > self._last_turn + KEY_LATENCY_S:
            self._turn(0.0, keyboard)  # react to signals and keys even if playing is late

    def _turn(self, timeout: float, keyboard: Keyboard) -> str | None:
        """Run callbacks and react to a key; returns the key, if it had an effect."""
        self._spinner.once(min(timeout, KEY_LATENCY_S))
        now = self._last_turn = time.monotonic()
        match key := keyboard.pressed():
            case "space":
                self._timeline.toggle_pause(now)
                self._log("Pausing play." if self._timeline.paused else "Resuming play.")
            case "up":
                self._set_rate(self._timeline.rate + RATE_STEP, now)
            case "down":
                self._set_rate(self._timeline.rate - RATE_STEP, now)
            case "right" if not self._timeline.paused:
                self._node.get_logger().warning("Called play next, but not in paused state.")
                return None
        return key

    def _set_rate(self, rate: float, now: float) -> None:
        rate = round(rate, 6)  # ten steps of 0.1 add up to 1
        if rate > 0.0:
            self._timeline.set_rate(rate, now)
            self._log(f"Set rate to {rate:g}")
        else:
            self._node.get_logger().warning(f"Failed to set rate to invalid value {rate:g}")

    def _log(self, text: str) -> None:
        self._node.get_logger().info(text)


def _load(options: PlayerOptions) -> tuple[int, list[BagMessage]]:
    """The bag time of the start, and the messages to play, by log time and then in the order of recording.

    Raises:
        BagError: one line: the bag does not exist or has nothing to play.
    """
    bag, selection = find_bag(Path(options.bag)), options.selection
    messages = [entry for entry in read_bag(bag) if isinstance(entry, BagMessage)]
    if not messages:
        raise BagError(f"{bag}: the bag has no messages")
    recorded = {message.topic for message in messages}
    if unknown := sorted(set(selection.names) - recorded):
        raise BagError(f"{bag}: no topic {unknown[0]}, expected one of {', '.join(sorted(recorded))}")
    messages.sort(key=lambda message: message.log_time_ns)
    first_ns = messages[0].log_time_ns
    start_ns, end_ns = options.start_ns(first_ns), options.end_ns(first_ns)
    selected = [
        message
        for message in messages
        if start_ns <= message.log_time_ns
        and (end_ns is None or message.log_time_ns <= end_ns)
        and selection.takes(message.topic, message.type_name)
    ]
    if not selected:
        raise BagError(f"{bag}: nothing to play: no message matches the given topics and times")
    return start_ns, selected


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the node; its command line is that of the process unless it is given."""
    _, name = split_node_name(PLAYER_NODE)
    return run_node(lambda: rclpy.create_node(name), Player, arguments=arguments)
