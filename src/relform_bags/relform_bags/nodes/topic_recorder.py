"""Record the topics of any running system."""

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
from relform_bags.nodes.open_bag import OpenBag
from relform_bags.nodes.option_parameters import read_options
from relform_bags.options import TopicRecorderOptions
from relform_core.errors import BagError
from relform_core.installed import software_versions
from relform_core.names import VERSIONS_ATTACHMENT
from relform_ros.raw import subscribe_raw
from relform_ros.spinner import Spinner, StopRequestedError

DISCOVERY_PERIOD_S = 0.1
DEPTH = 1000


class TopicRecorder:
    """Discovers topics and writes the messages of all or of chosen ones, until a signal ends it.

    The log time of a message is the time of its arrival: wall time or, with ``use_sim_time``, the newest tick
    of /clock, which is 0 before the first.
    """

    def __init__(self, node: Node, spinner: Spinner) -> None:
        self._node = node
        self._spinner = spinner
        self._options = read_options(node, TopicRecorderOptions)
        self._selection = self._options.selection
        self._paused = self._options.start_paused
        self._subscriptions: dict[str, Subscription] = {}
        self._refused: set[str] = set()

    async def run(self) -> None:
        """Record until a signal arrives.

        Raises:
            BagError: the bag cannot be created or written.
        """
        attachments = {VERSIONS_ATTACHMENT: json.dumps(software_versions(), indent=2)}
        bag = OpenBag(self._node, self._spinner, self._options, attachments)
        try:
            with terminal_keyboard(self._options.keyboard) as keyboard:
                if keyboard.is_connected:
                    self._log("Press SPACE for pausing/resuming")
                self._log("Listening for topics...")
                self._log("Wait for recording: Press SPACE to start." if self._paused else "Recording...")
                while not bag.is_full:
                    self._discover(bag)
                    self._turn(bag, keyboard)
        except StopRequestedError:
            pass
        finally:
            bag.close()
        self._log("Recording stopped")
        self._sum_up(bag)

    def _turn(self, bag: OpenBag, keyboard: Keyboard) -> None:
        """Record for one period of the discovery, then react to a key."""
        deadline = time.monotonic() + DISCOVERY_PERIOD_S
        while time.monotonic() < deadline and not bag.is_full:
            self._spinner.once(DISCOVERY_PERIOD_S)
        if keyboard.pressed() == "space":
            self._paused = not self._paused
            self._log("Pausing recording." if self._paused else "Resuming recording.")

    def _sum_up(self, bag: OpenBag) -> None:
        if self._now_ns() == 0:
            print("/clock had no tick: all messages have the log time 0", file=sys.stderr)
        for name in self._selection.names:
            if name not in self._subscriptions and name not in self._refused:
                print(f"{name} was not published: the bag has no message of it", file=sys.stderr)
        print(f"{self._options.output}: {bag.message_count} messages on {len(self._subscriptions)} topics")

    def _now_ns(self) -> int:
        return int(self._node.get_clock().now().nanoseconds)

    def _discover(self, bag: OpenBag) -> None:
        """Subscribe to new topics."""
        for name, type_names in self._node.get_topic_names_and_types():
            if name in self._subscriptions or name in self._refused or not self._wants(name, type_names[0]):
                continue
            publishers = self._node.get_publishers_info_by_topic(name)
            if all(info.node_name == self._node.get_name() for info in publishers):
                continue  # only this node publishes it
            try:
                self._subscribe(name, type_names[0], publishers, bag)
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
        self, name: str, type_name: str, publishers: Iterable[TopicEndpointInfo], bag: OpenBag
    ) -> None:
        bag.add_topic(name, type_name)

        def take(data: bytes, publish_time_ns: int) -> None:
            if not self._paused:
                bag.write(name, data, self._now_ns(), publish_time_ns)

        self._subscriptions[name] = subscribe_raw(
            self._node, message_class(type_name), name, take, matching_qos(publishers)
        )
        self._log(f"Subscribed to topic '{name}'")

    def _log(self, text: str) -> None:
        self._node.get_logger().info(text)


def matching_qos(publishers: Iterable[TopicEndpointInfo]) -> QoSProfile:
    """The quality of service that all publishers serve: reliable or latched only if all of them are."""
    offers = [info.qos_profile for info in publishers]
    reliable = all(offer.reliability == ReliabilityPolicy.RELIABLE for offer in offers)
    latched = all(offer.durability == DurabilityPolicy.TRANSIENT_LOCAL for offer in offers)
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=DEPTH,
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
    )
