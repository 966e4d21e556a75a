"""Check that the player publishes every message of a bag, in order and in time."""

import subprocess
import time
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt
import rclpy
from rclpy.context import Context
from rclpy.qos import DurabilityPolicy, QoSProfile

from relform_bags.from_bag import as_installed, decode
from relform_bags.message_types import message_class
from relform_bags.options import PlayerOptions
from relform_bags.reader import BagMessage, read_bag
from relform_core.errors import BagError
from relform_core.installed import executable
from relform_core.units import NANOSECONDS_PER_SECOND
from relform_ros.raw import subscribe_raw
from relform_ros.spinner import Spinner

QOS = QoSProfile(depth=10_000, durability=DurabilityPolicy.TRANSIENT_LOCAL)
SUBSCRIBERS_MAX_S = 30.0
QUIET_S = 0.5


@dataclass(frozen=True)
class PlayedMessage:
    """A message that was received."""

    topic: str
    data: bytes
    publish_time_ns: int


@dataclass(frozen=True)
class PlaybackCheck:
    """The messages of a bag, and those that were received."""

    expected: tuple[BagMessage, ...]
    """By log time."""
    heard: tuple[PlayedMessage, ...]
    """By the time at which the player published them."""
    rate: float

    @property
    def is_complete(self) -> bool:
        """Whether every message was received once, in the order of the bag across all topics."""
        return len(self.expected) == len(self.heard) and all(
            sent.topic == heard.topic and _is_same(sent, heard.data)
            for sent, heard in zip(self.expected, self.heard, strict=True)
        )

    @property
    def delay(self) -> npt.NDArray[np.float64]:
        """How much later than due each message was published, relative to the first one [s]."""
        log_ns = np.array([message.log_time_ns for message in self.expected], dtype=np.float64)
        publish_ns = np.array([message.publish_time_ns for message in self.heard], dtype=np.int64)
        due_ns = (log_ns - log_ns[0]) / self.rate
        delay: npt.NDArray[np.float64] = (publish_ns - publish_ns[0] - due_ns) / NANOSECONDS_PER_SECOND
        return delay


def _is_same(sent: BagMessage, heard: bytes) -> bool:
    """Whether two serialized messages are equal; the middleware pads them to multiples of four bytes."""
    padding = heard.removeprefix(sent.data)
    if heard.startswith(sent.data) and len(padding) < 4 and not any(padding):
        return True
    # The bytes between the fields of a message that was converted are arbitrary.
    return not sent.definition and str(decode(sent)) == str(decode(replace(sent, data=heard)))


def check_playback(bag: Path, rate: float) -> PlaybackCheck:
    """Play a bag with the node ``player`` and receive its messages.

    Raises:
        BagError: the bag cannot be played.
    """
    messages = [as_installed(entry) for entry in read_bag(bag) if isinstance(entry, BagMessage)]
    messages.sort(key=lambda message: message.log_time_ns)
    heard: list[PlayedMessage] = []
    context = Context()
    rclpy.init(context=context)
    node = rclpy.create_node("playback_check", context=context, enable_rosout=False)
    spinner = Spinner(node)
    try:
        for topic, type_name in {message.topic: message.type_name for message in messages}.items():

            def take(data: bytes, publish_time_ns: int, topic: str = topic) -> None:
                heard.append(PlayedMessage(topic, data, publish_time_ns))

            subscribe_raw(node, message_class(type_name), topic, take, QOS)
        options = PlayerOptions(str(bag), rate=rate, wait_s=SUBSCRIBERS_MAX_S, keyboard=False)
        player_path = executable("relform_bags", "player")
        command = [player_path, "--ros-args", "--log-level", "warn", *options.parameter_arguments()]
        with subprocess.Popen(command, stdin=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True) as player:
            while player.poll() is None:
                spinner.once(0.1)
            _, errors = player.communicate()
        if player.returncode != 0:
            raise BagError(errors.strip())
        quiet_since, count = time.monotonic(), len(heard)
        while len(heard) < len(messages) and time.monotonic() < quiet_since + QUIET_S:
            spinner.once(0.1)
            if len(heard) > count:
                quiet_since, count = time.monotonic(), len(heard)
    finally:
        spinner.close()
        node.destroy_node()
        rclpy.shutdown(context=context)
    heard.sort(key=lambda message: message.publish_time_ns)
    return PlaybackCheck(tuple(messages), tuple(heard), rate)
