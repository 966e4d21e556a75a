"""Plays a bag: every message on its topic again, in its order and at its time."""

import time
from collections.abc import Sequence
from pathlib import Path

import rclpy
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rosgraph_msgs.msg import Clock as ClockMsg

from relform_bags.keyboard import Keyboard, terminal_keyboard
from relform_bags.message_types import message_class
from relform_bags.reader import BagMessage, find_bag, read_bag
from relform_bags.timeline import PlaybackOptions, Timeline
from relform_bags.topic_selection import TopicSelection, absolute
from relform_core.errors import BagError, ConfigError
from relform_ros.fields import stamp_to_msg
from relform_ros.parameters import read_only
from relform_ros.run_node import Spinner, run_node

KEY_LATENCY_S = 0.05
RATE_STEP = 0.1
CLOCK = "/clock"
QOS = QoSProfile(
    depth=1000, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.TRANSIENT_LOCAL
)
"""Serves every subscription, best effort and volatile ones too; late ones get what was published before."""
CLOCK_QOS = QoSProfile(
    depth=10, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.TRANSIENT_LOCAL
)
"""Likewise, but late ones need no more than what time it is."""
KEYS = {
    "SPACE": "Pause/Resume",
    "CURSOR_RIGHT": "Play Next Message",
    "CURSOR_UP": "Increase Rate 10%",
    "CURSOR_DOWN": "Decrease Rate 10%",
}
"""In the words of rosbag2."""


class Player:
    """Publishes the messages of a bag."""

    def __init__(self, node: Node, spinner: Spinner) -> None:
        self._node = node
        self._spinner = spinner
        bag = read_only(node, "bag", "", "Bag to play: its file, its folder or the folder of a run.")
        if not bag:
            raise ConfigError("parameter bag is not set: add --ros-args -p bag:=<bag or folder of a run>")
        self._options = PlaybackOptions(
            rate=read_only(node, "rate", 1.0, "Bag time per wall time."),
            start_offset=read_only(node, "start_offset_s", 0.0, "Bag time to skip at the start [s]."),
            duration=read_only(node, "duration_s", -1.0, "Bag time to play [s]; negative: to the end."),
            until_ns=read_only(node, "until_ns", -1, "Bag time to end at, if later [ns]; negative: none."),
            delay=read_only(node, "delay_s", 0.0, "Wall time to wait before each start [s]."),
            loop=read_only(node, "loop", False, "Start again at the end."),
            start_paused=read_only(node, "start_paused", False, "Wait for the space key."),
        )
        self._wait_max = read_only(
            node, "wait_s", 1.0, "Wall time that subscribers of all topics may take to be found [s]."
        )
        self._ack_wait = read_only(
            node, "ack_wait_s", 5.0, "Wall time that the last messages may take to arrive [s]; 0: any."
        )
        self._has_keys = read_only(node, "keyboard", True, "Listen to the keys of the terminal.")
        clock_hz = read_only(
            node, "clock_hz", 0.0, "Rate of a /clock of the player's own, in place of the recorded one."
        )
        self._clock_topics = _names(node, "clock_topics", "Topics each message of which comes with /clock.")
        self._clock_always = read_only(node, "clock_topics_all", False, "Every message does.")
        excluded = _names(node, "exclude_topics", "Topics not to play.")
        selection = TopicSelection(
            names=_names(node, "topics", "Topics to play; empty: all."),
            regex=read_only(node, "regex", "", "Play only topics that match it as a whole."),
            exclude_names=(*excluded, CLOCK) if clock_hz > 0.0 else excluded,
            exclude_regex=read_only(node, "exclude_regex", "", "Do not play topics that match it."),
            whole_name=True,
        )
        self._start_ns, self._messages = _load(Path(bag), selection, self._options)
        self._publishers = self._create_publishers()
        self._messages = [message for message in self._messages if message.topic in self._publishers]
        if not self._messages:
            raise BagError(f"{bag}: no message type of it is installed, or its setup file not sourced")
        self._timeline = Timeline(self._start_ns, self._options.rate, 0.0, paused=True)  # until run()
        self._last_turn = 0.0
        self._clock = self._create_clock(clock_hz)

    def run(self) -> None:
        """Play to the end, or until a signal arrives."""
        with terminal_keyboard(self._has_keys) as keyboard:
            self._log(f"Set rate to {self._options.rate:g}")
            if keyboard.is_there:
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
        for publisher in self._publishers.values():
            limit = rclpy.duration.Duration(seconds=self._ack_wait if self._ack_wait > 0.0 else -1.0)
            if not publisher.wait_for_all_acked(limit):
                self._node.get_logger().error(f"the last messages on {publisher.topic_name} did not arrive")

    def _create_publishers(self) -> dict[str, Publisher]:
        """By topic; remappings on the command line hold for these names as for any other."""
        publishers = {}
        for topic, type_name in {message.topic: message.type_name for message in self._messages}.items():
            try:
                publishers[topic] = self._node.create_publisher(message_class(type_name), topic, QOS)
            except BagError as error:
                self._node.get_logger().warning(f"Ignoring a topic '{topic}', reason: {error}.")
        return publishers

    def _create_clock(self, frequency: float) -> Publisher | None:
        if frequency <= 0.0 and not self._clock_topics and not self._clock_always:
            return None
        publisher = self._node.create_publisher(ClockMsg, CLOCK, CLOCK_QOS)
        if frequency > 0.0:
            steady = Clock(clock_type=ClockType.STEADY_TIME)
            self._node.create_timer(1.0 / frequency, self._tick, clock=steady)
        return publisher

    def _tick(self) -> None:
        """Publish the bag time of now."""
        assert self._clock is not None
        self._clock.publish(ClockMsg(clock=stamp_to_msg(self._timeline.bag_time_ns(time.monotonic()))))

    def _await_subscribers(self) -> None:
        """Give those who are there the time to be found, so that they hear the first messages too."""
        deadline = time.monotonic() + self._wait_max
        while time.monotonic() < deadline and not all(
            publisher.get_subscription_count() for publisher in self._publishers.values()
        ):
            self._spinner.once(KEY_LATENCY_S)

    def _delay(self, keyboard: Keyboard) -> None:
        deadline = time.monotonic() + self._options.delay
        while (left := deadline - time.monotonic()) > 0.0:
            self._turn(left, keyboard)

    def _play(self, keyboard: Keyboard) -> None:
        """Play all messages once; in a pause that lasts, do not end."""
        for message in self._messages:
            self._wait(message.log_time_ns, keyboard)
            if self._clock_always or message.topic in self._clock_topics:
                self._tick()
            self._publishers[message.topic].publish(message.data)
        while self._timeline.paused:
            self._turn(KEY_LATENCY_S, keyboard)

    def _wait(self, bag_time_ns: int, keyboard: Keyboard) -> None:
        """Return when a bag time has come, or the message at it was asked for."""
        while (left := self._timeline.wait_for(bag_time_ns, time.monotonic())) is None or left > 0.0:
            if self._turn(KEY_LATENCY_S if left is None else left, keyboard) == "right":
                self._timeline.jump(bag_time_ns, time.monotonic())
                return
        if time.monotonic() > self._last_turn + KEY_LATENCY_S:
            self._turn(0.0, keyboard)  # however late it is, there are signals and keys

    def _turn(self, timeout: float, keyboard: Keyboard) -> str | None:
        """Let callbacks run and do what a key says; the key, if it had something to say."""
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
        rate = round(rate, 6)  # ten steps of a tenth are one
        if rate > 0.0:
            self._timeline.set_rate(rate, now)
            self._log(f"Set rate to {rate:g}")
        else:
            self._node.get_logger().warning(f"Failed to set rate to invalid value {rate:g}")

    def _log(self, text: str) -> None:
        self._node.get_logger().info(text)


def _load(path: Path, selection: TopicSelection, options: PlaybackOptions) -> tuple[int, list[BagMessage]]:
    """Bag time of the start, and what to play by log time; what is of one instant in the order of recording.

    Raises:
        BagError: one line: there is no such bag, or nothing in it to play.
    """
    bag = find_bag(path)
    messages = [entry for entry in read_bag(bag) if isinstance(entry, BagMessage)]
    if not messages:
        raise BagError(f"{bag}: there is no message in it")
    recorded = {message.topic for message in messages}
    if unknown := sorted(set(selection.names) - recorded):
        raise BagError(f"{bag}: no topic {unknown[0]}; recorded are {', '.join(sorted(recorded))}")
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
        raise BagError(f"{bag}: nothing to play, of the topics and the time that were chosen")
    return start_ns, selected


def _names(node: Node, name: str, description: str) -> Sequence[str]:
    return [absolute(topic) for topic in read_only(node, name, [""], description) if topic]


def main() -> int:
    """Run the node."""
    return run_node(lambda: rclpy.create_node("player"), Player)
