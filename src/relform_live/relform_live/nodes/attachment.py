"""The connection of a view to a running flight: its scenario, and its newest messages."""

from collections import deque
from collections.abc import Iterator
from typing import Any

from rcl_interfaces.srv import GetParameters
from rclpy.node import Node
from rclpy.qos import HistoryPolicy, QoSProfile, ReliabilityPolicy
from rclpy.subscription import Subscription

from relform_core.errors import ConfigError, MessageError
from relform_core.load import LoadedScenario, load_scenario
from relform_core.names import CONTROLLER_NODE
from relform_core.roster import Roster
from relform_live.scene.channel import Channel
from relform_ros.raw import decoded
from relform_ros.topics import topic_table

NEWEST = QoSProfile(history=HistoryPolicy.KEEP_LAST, depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)
"""A view that is slow or lost must not make a flight wait or send again."""
ANSWER_S = 3.0
"""After this time without an answer the question is asked again."""


class ScenarioQuestion:
    """Asks the controller of a flight for its scenario.

    The parameter holds the path of a file, which is the effective configuration in a run folder or the file
    that the user named.
    """

    def __init__(self, node: Node) -> None:
        self._client = node.create_client(GetParameters, f"{CONTROLLER_NODE}/get_parameters")
        self._future: Any = None
        self._asked = 0.0

    @property
    def is_answerable(self) -> bool:
        """Whether a controller is running."""
        return bool(self._client.service_is_ready())

    def answer(self, now: float) -> str | None:
        """The path of the scenario; None: not answered yet, ask again later. ``now``: a steady time [s]."""
        if self._future is not None and self._future.done():
            values = self._future.result().values
            self._future = None
            return values[0].string_value if values else ""
        if self.is_answerable and (self._future is None or now > self._asked + ANSWER_S):
            self._future, self._asked = (
                self._client.call_async(GetParameters.Request(names=["scenario"])),
                now,
            )
        return None


def load_answer(path: str) -> LoadedScenario:
    """The scenario of a running flight.

    Raises:
        ConfigError: its file cannot be read here.
    """
    try:
        return load_scenario(path)
    except ConfigError as error:
        reason = str(error).splitlines()[0]
        raise ConfigError(
            f"{CONTROLLER_NODE} flies a scenario that cannot be read here, name it with --config: {reason}"
        ) from None


class Reading:
    """Subscriptions to the topics of a flight; messages stay serialized until a frame needs them."""

    def __init__(self, node: Node, scenario: LoadedScenario, channels: dict[str, Channel]) -> None:
        self._node = node
        self._channels = channels
        table = topic_table(scenario.config, Roster.of(scenario.config))
        self._types = {topic: table[topic].type for topic in channels}
        self._waiting = {topic: deque[bytes](maxlen=channel.kept) for topic, channel in channels.items()}
        self._subscriptions: list[Subscription] = [
            self._subscribe(topic, waiting) for topic, waiting in self._waiting.items()
        ]
        self.rejected = ""
        """Why a message could not be used; empty: all could."""

    def take_in(self) -> None:
        """Give what has arrived to its channels."""
        for topic, data in self._arrived():
            try:
                self._channels[topic].take(decoded(data, self._types[topic]))
            except MessageError as error:
                self.rejected = f"{topic}: {error}"

    def _subscribe(self, topic: str, waiting: deque[bytes]) -> Subscription:
        def take(data: bytes) -> None:  # rclpy wants a function with a signature
            waiting.append(data)

        return self._node.create_subscription(self._types[topic], topic, take, NEWEST, raw=True)

    def _arrived(self) -> Iterator[tuple[str, bytes]]:
        for topic, waiting in self._waiting.items():
            while waiting:
                yield topic, waiting.popleft()

    def close(self) -> None:
        """End the subscriptions."""
        for subscription in self._subscriptions:
            self._node.destroy_subscription(subscription)
