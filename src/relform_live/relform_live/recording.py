"""A recorded flight that is shown again: which of its messages count at which time."""

from bisect import bisect_right
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from relform_core.units import NANOSECONDS_PER_SECOND
from relform_live.scene.channel import Channel
from relform_live.scene.flight_data import FlightData
from relform_live.scene.stage import Stage

JUMP_NS = NANOSECONDS_PER_SECOND
"""A step forward in time by more than this is a jump: the messages in between are left out."""
BEFORE_NS = 15 * NANOSECONDS_PER_SECOND
"""After a jump the flight is taken in from this time before, so that there are trails and a plot."""
STEP_NS = NANOSECONDS_PER_SECOND // 10


@dataclass(frozen=True, eq=False)
class Series:
    """The messages of a topic, in the order of their stamps."""

    stamps_ns: Sequence[int]
    messages: Sequence[Any]


class Recording:
    """A recorded flight, at the time to which it was advanced last."""

    def __init__(
        self, data: FlightData, channels: Mapping[str, Channel], series: Mapping[str, Series]
    ) -> None:
        """Begin before the first message.

        Args:
            data: what the channels fill.
            channels, series: by topic; there is at least one message.
        """
        self.data = data
        self._channels = channels
        self._series = series
        self._next = dict.fromkeys(series, 0)
        """Index of the first message that was not taken in, by topic."""
        self._now_ns = self.start_ns - 1

    @property
    def start_ns(self) -> int:
        """The first instant of the flight."""
        return min(series.stamps_ns[0] for series in self._series.values())

    @property
    def end_ns(self) -> int:
        """The last instant of the flight."""
        return max(series.stamps_ns[-1] for series in self._series.values())

    def advance(self, stage: Stage, stamp_ns: int) -> None:
        """Take in the messages up to an instant; to go back, or far ahead, is a jump."""
        if not self._now_ns <= stamp_ns <= self._now_ns + JUMP_NS:
            first_ns = stamp_ns - BEFORE_NS
            self.data.clear()
            stage.clear()
            for topic, series in self._series.items():
                is_log = self._channels[topic].keeps_all
                self._next[topic] = 0 if is_log else bisect_right(series.stamps_ns, first_ns)
            for each_ns in range(first_ns, stamp_ns, STEP_NS):
                self._take_in(each_ns)
                stage.advance(each_ns)
        self._take_in(stamp_ns)
        self._now_ns = stamp_ns

    def _take_in(self, stamp_ns: int) -> None:
        """Take in what has not been, as far as a channel keeps it.

        The first message after the instant is taken in too, unless it is an event: between the two a pose is
        interpolated.
        """
        for topic, series in self._series.items():
            channel, begin = self._channels[topic], self._next[topic]
            end = bisect_right(series.stamps_ns, stamp_ns)
            if not channel.keeps_all:
                end = min(end + 1, len(series.stamps_ns))
            if end > begin:
                first = begin if channel.keeps_all else max(begin, end - channel.kept)
                for message in series.messages[first:end]:
                    channel.take(message)
                self._next[topic] = end
