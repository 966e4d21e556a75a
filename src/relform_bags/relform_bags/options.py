"""Options of the nodes that record and play: each with its name, default and description.

A node declares a parameter for each option of its class, and a command adds an argument for it.
"""

import json
import math
from argparse import Namespace
from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from typing import Self, TypeVar

from relform_bags.split_limits import SplitLimits
from relform_bags.topic_selection import TopicSelection, absolute
from relform_core.errors import BagError
from relform_core.names import CLOCK
from relform_core.units import NANOSECONDS_PER_SECOND

DESCRIPTION = "description"
"""Key in the metadata of a field."""

Value = bool | int | float | str | tuple[str, ...]
T = TypeVar("T", bound=Value)


def _option(default: T, description: str) -> T:
    return field(default=default, metadata={DESCRIPTION: description})


@dataclass(frozen=True)
class Options:
    """Base of the options of a node; each field is a parameter of the node."""

    @classmethod
    def from_arguments(cls, arguments: Namespace) -> Self:
        """The options that a command line gives; those without an argument keep their defaults."""
        names = [option.name for option in fields(cls) if option.name in arguments]
        values = {name: getattr(arguments, name) for name in names}
        return cls(
            **{name: tuple(value) if isinstance(value, list) else value for name, value in values.items()}
        )

    def parameter_arguments(self) -> list[str]:
        """Arguments behind ``--ros-args`` that give a node these options."""
        return [
            argument
            for option in fields(self)
            for argument in ("-p", f"{option.name}:={_parameter_yaml(getattr(self, option.name))}")
        ]


def _parameter_yaml(value: Value) -> str:
    """A value as rcl reads it: JSON is YAML; an empty list would have no type."""
    return json.dumps((value or ("",)) if isinstance(value, tuple) else value)


@dataclass(frozen=True)
class RecorderOptions(Options):
    """Options of a recorder, in a flight or on its own."""

    output: str = _option("", "Folder of the new bag.")
    topics: tuple[str, ...] = _option((), "Topics to record; empty: all.")
    max_bag_size: int = _option(0, "Continue in the next file of the bag at this size [bytes]; 0: never.")
    max_bag_duration: int = _option(0, "Continue in the next file after this log time [s]; 0: never.")

    def __post_init__(self) -> None:
        """Raises BagError if an option is out of its bounds."""
        _ = self.limits

    @property
    def limits(self) -> SplitLimits:
        """When to continue in the next file."""
        return SplitLimits(self.max_bag_size, self.max_bag_duration)

    @property
    def selection(self) -> TopicSelection:
        """Which topics to record."""
        return TopicSelection(_absolute(self.topics))


@dataclass(frozen=True)
class TopicRecorderOptions(RecorderOptions):
    """Options of a recorder outside a flight, which discovers its topics."""

    topic_types: tuple[str, ...] = _option((), "Record topics of these types.")
    regex: str = _option("", "Record topics with a match of this expression in their names.")
    exclude_topics: tuple[str, ...] = _option((), "Do not record these topics.")
    exclude_topic_types: tuple[str, ...] = _option((), "Do not record topics of these types.")
    exclude_regex: str = _option("", "Do not record topics with a match of this expression in their names.")
    include_hidden_topics: bool = _option(False, "Record hidden topics, too.")
    start_paused: bool = _option(False, "Wait for the space key.")
    keyboard: bool = _option(True, "Pause and resume at the space key.")

    @property
    def selection(self) -> TopicSelection:
        """Which topics to record.

        Raises:
            BagError: an expression is not valid.
        """
        return TopicSelection(
            names=_absolute(self.topics),
            types=self.topic_types,
            regex=self.regex,
            exclude_names=_absolute(self.exclude_topics),
            exclude_types=self.exclude_topic_types,
            exclude_regex=self.exclude_regex,
        )


@dataclass(frozen=True)
class PlayerOptions(Options):
    """Options of the player."""

    bag: str = _option("", "Bag to play: its file, its folder or the folder of a run.")
    rate: float = _option(1.0, "Bag time per wall time.")
    start_offset_s: float = _option(0.0, "Bag time to skip at the start [s].")
    duration_s: float = _option(-1.0, "Bag time to play [s]; negative: to the end.")
    until_ns: int = _option(-1, "Bag time to end at, if that is later [ns]; negative: none.")
    delay_s: float = _option(0.0, "Wall time to wait before each start [s].")
    loop: bool = _option(False, "Start again at the end.")
    start_paused: bool = _option(False, "Wait for the space key.")
    topics: tuple[str, ...] = _option((), "Topics to play; empty: all.")
    regex: str = _option("", "Play only topics with names that match this expression as a whole.")
    exclude_topics: tuple[str, ...] = _option((), "Do not play these topics.")
    exclude_regex: str = _option("", "Do not play topics with names that match this expression as a whole.")
    clock_hz: float = _option(0.0, "Publish /clock at this rate, in place of the recorded one; 0: do not.")
    clock_topics: tuple[str, ...] = _option((), "Publish /clock before each message of these topics.")
    clock_topics_all: bool = _option(False, "Publish /clock before every message.")
    wait_s: float = _option(1.0, "Wall time to wait for subscribers of all topics, at most [s].")
    ack_wait_s: float = _option(5.0, "Wall time to wait until the last messages arrive [s]; 0: no limit.")
    keyboard: bool = _option(True, "Listen to the keys of the terminal.")

    def __post_init__(self) -> None:
        """Raises BagError if an option is out of its bounds."""
        if not 0.0 < self.rate < math.inf:
            raise BagError(f"rate must be above 0 (got {self.rate})")
        if not 0.0 <= self.start_offset_s < math.inf:
            raise BagError(f"start offset must be at least 0 s (got {self.start_offset_s})")
        if not 0.0 <= self.delay_s < math.inf:
            raise BagError(f"delay must be at least 0 s (got {self.delay_s})")
        if math.isnan(self.duration_s):
            raise BagError("duration must be a number (got nan)")

    @property
    def selection(self) -> TopicSelection:
        """Which topics to play.

        Raises:
            BagError: an expression is not valid.
        """
        excluded = _absolute(self.exclude_topics)
        return TopicSelection(
            names=_absolute(self.topics),
            regex=self.regex,
            exclude_names=(*excluded, CLOCK) if self.clock_hz > 0.0 else excluded,
            exclude_regex=self.exclude_regex,
            whole_name=True,
        )

    def has_clock_before(self, topic: str) -> bool:
        """Whether /clock is published before each message of a topic."""
        return self.clock_topics_all or topic in _absolute(self.clock_topics)

    def start_ns(self, bag_start_ns: int) -> int:
        """Bag time at which to start."""
        return bag_start_ns + round(self.start_offset_s * NANOSECONDS_PER_SECOND)

    def end_ns(self, bag_start_ns: int) -> int | None:
        """Last bag time to play; None: that of the bag."""
        ends = [self.until_ns] if self.until_ns >= 0 else []
        if 0.0 <= self.duration_s < math.inf:
            ends.append(self.start_ns(bag_start_ns) + round(self.duration_s * NANOSECONDS_PER_SECOND))
        return max(ends, default=None)


def _absolute(topics: Sequence[str]) -> tuple[str, ...]:
    return tuple(absolute(topic) for topic in topics)
