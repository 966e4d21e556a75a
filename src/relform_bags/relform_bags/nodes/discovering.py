"""A recorder of whatever is published, of relform or not."""

import json
import sys
import time
from collections.abc import Iterable

from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from rclpy.subscription import Subscription
from rclpy.topic_endpoint_info import TopicEndpointInfo

from relform_bags.keyboard import Keyboard, terminal_keyboard
from relform_bags.message_types import message_class
from relform_bags.nodes.option_parameters import read_options
from relform_bags.nodes.recording import Recording
from relform_bags.options import TopicRecorderOptions
from relform_core.errors import BagError
from relform_core.installed import software_versions
from relform_core.names import VERSIONS_ATTACHMENT
from relform_ros.raw import subscribe_raw
from relform_ros.run_node import Spinner, StopRequestedError

LOOK_EVERY_S = 0.1
DEPTH = 1000


class DiscoveringRecorder:
    """Writes the messages of all topics that it finds, or of chosen ones, until a signal ends it.

    Their log time is when they arrive: wall time, or with ``use_sim_time`` the newest tick of /clock; it is 0
    before the first.
    """

    def __init__(self, node: Node, spinner: Spinner) -> None:
        self._node = node
        self._spinner = spinner
        self._options = read_options(node, TopicRecorderOptions)
        self._selection = self._options.selection
        self._paused = self._options.start_paused
        self._subscriptions: dict[str, Subscription] = {}
        self._refused: set[str] = set()

    def run(self) -> None:
        """Record until a signal arrives.

        Raises:
            BagError: the bag cannot be created or written.
        """
        attachments = {VERSIONS_ATTACHMENT: json.dumps(software_versions(), indent=2)}
        recording = Recording(self._node, self._spinner, self._options, attachments)
        try:
            with terminal_keyboard(self._options.keyboard) as keyboard:
                if keyboard.is_there:
                    self._log("Press SPACE for pausing/resuming")
                self._log("Listening for topics...")
                self._log("Wait for recording: Press SPACE to start." if self._paused else "Recording...")
                while not recording.is_full:
                    self._look(recording)
                    self._turn(recording, keyboard)
        except StopRequestedError:
            pass
        finally:
            recording.close()
        self._log("Recording stopped")
        self._sum_up(recording)

    def _turn(self, recording: Recording, keyboard: Keyboard) -> None:
        """Record until it is time to look for topics again."""
        deadline = time.monotonic() + LOOK_EVERY_S
        while time.monotonic() < deadline and not recording.is_full:
            self._spinner.once(LOOK_EVERY_S)
        if keyboard.pressed() == "space":
            self._paused = not self._paused
            self._log("Pausing recording." if self._paused else "Resuming recording.")

    def _sum_up(self, recording: Recording) -> None:
        if self._now_ns() == 0:
            print("there was no tick of /clock: all messages have the log time 0", file=sys.stderr)
        for name in self._selection.names:
            if name not in self._subscriptions and name not in self._refused:
                print(f"{name} was not published: nothing of it is recorded", file=sys.stderr)
        print(
            f"{self._options.output}: {recording.message_count} messages on {len(self._subscriptions)} topics"
        )

    def _now_ns(self) -> int:
        return int(self._node.get_clock().now().nanoseconds)

    def _look(self, recording: Recording) -> None:
        """Subscribe to what is new."""
        for name, type_names in self._node.get_topic_names_and_types():
            if name in self._subscriptions or name in self._refused or not self._wants(name, type_names[0]):
                continue
            publishers = self._node.get_publishers_info_by_topic(name)
            if all(info.node_name == self._node.get_name() for info in publishers):
                continue  # nobody but this node publishes it
            try:
                self._subscribe(name, type_names[0], publishers, recording)
            except BagError as error:
                self._refused.add(name)
                print(
                    f"{self._node.get_fully_qualified_name()}: {name} is not recorded: {error}",
                    file=sys.stderr,
                )

    def _wants(self, name: str, type_name: str) -> bool:
        hidden = any(part.startswith("_") for part in name.split("/"))
        if hidden and not self._options.include_hidden_topics and name not in self._selection.names:
            return False
        return self._selection.takes(name, type_name)

    def _subscribe(
        self, name: str, type_name: str, publishers: Iterable[TopicEndpointInfo], recording: Recording
    ) -> None:
        recording.add_topic(name, type_name)

        def take(data: bytes, publish_time_ns: int) -> None:
            if not self._paused:
                recording.write(name, data, self._now_ns(), publish_time_ns)

        self._subscriptions[name] = subscribe_raw(
            self._node, message_class(type_name), name, take, matching_qos(publishers)
        )
        self._log(f"Subscribed to topic '{name}'")

    def _log(self, text: str) -> None:
        self._node.get_logger().info(text)


def matching_qos(publishers: Iterable[TopicEndpointInfo]) -> QoSProfile:
    """What all these publishers can serve: reliable, and with the messages before, only if all offer it."""
    offers = [info.qos_profile for info in publishers]
    reliable = all(offer.reliability == ReliabilityPolicy.RELIABLE for offer in offers)
    latched = all(offer.durability == DurabilityPolicy.TRANSIENT_LOCAL for offer in offers)
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=DEPTH,
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
    )
