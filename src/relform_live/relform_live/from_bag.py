"""Recorded flights for the view."""

from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

from relform_analysis.flight.bag_configuration import find_configuration
from relform_bags.from_bag import as_installed
from relform_bags.message_types import message_class
from relform_bags.reader import BagMessage, find_bag, read_bag
from relform_core.errors import BagError, MessageError
from relform_core.names import EVENTS, EventKind
from relform_live.nodes.intake import channels
from relform_live.recording import Recording, Series
from relform_live.scene.channel import Channel
from relform_live.scene.flight_data import FlightData
from relform_ros.raw import decoded, raw_stamp_ns
from relform_ros.rejection import RejectionError


def read_recording(path: Path | str, configuration: Path | str | None = None) -> Recording:
    """A recorded flight. Its messages stay serialized until they are shown.

    Args:
        path: the bag's file or folder, or the folder of the run.
        configuration: path or plain name of the scenario; None: as ``find_configuration`` finds it.
    Raises:
        BagError: one line: there is no bag, no configuration or no flight.
    """
    bag = find_bag(path)
    data = FlightData(find_configuration(bag, configuration).load().config)
    takers = channels(data)
    recorded: dict[str, list[BagMessage]] = {}
    for entry in read_bag(bag, takers):
        if isinstance(entry, BagMessage):
            with suppress(RejectionError):
                if not _is_routine(entry):
                    raw_stamp_ns(entry.data)
                    recorded.setdefault(entry.topic, []).append(as_installed(entry))
    if not recorded:
        raise BagError(f"{bag}: no flight in it: it has none of the topics {', '.join(sorted(takers))}")
    series = {topic: _series(messages) for topic, messages in recorded.items()}
    types = {topic: message_class(messages[0].type_name) for topic, messages in recorded.items()}
    serialized = {
        topic: Channel(_decoded(takers[topic].take, type_), takers[topic].kept, takers[topic].keeps_all)
        for topic, type_ in types.items()
    }
    return Recording(data, serialized, series)


def _is_routine(message: BagMessage) -> bool:
    """Whether a message says that a step was computed, as one in each step does."""
    if message.topic != EVENTS:
        return False
    event = decoded(as_installed(message).data, message_class(message.type_name))
    return bool(event.kind == EventKind.STEP)


def _series(messages: list[BagMessage]) -> Series:
    stamped = sorted((raw_stamp_ns(message.data), message.data) for message in messages)
    return Series([stamp for stamp, _ in stamped], [data for _, data in stamped])


def _decoded(take: Callable[[Any], None], type_: type[Any]) -> Callable[[bytes], None]:
    """Takes in a serialized message; one that cannot be used is left out."""

    def take_serialized(data: bytes) -> None:
        with suppress(MessageError):
            take(decoded(data, type_))

    return take_serialized
