"""The recent past of a filter: what was measured and flown when, and what follows from it.

When something about the past becomes known late, the filter goes back to that instant and comes forward
again. So its result does not depend on the order of arrival.
"""

from bisect import bisect_left
from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Generic, TypeVar

K = TypeVar("K")
C = TypeVar("C")

Measured = dict[tuple[str, str], object]
"""Measurements by (vehicle, sensor)."""


@dataclass
class Instant(Generic[K, C]):
    """An instant at which something was measured, or at which the inputs changed."""

    stamp_ns: int
    before: K | None = None
    """What is known without the measurements of this instant; None: to be found again."""
    after: K | None = None
    """What is known with them; None: to be found again."""
    measured: Measured = field(default_factory=dict)
    inputs: C | None = None
    """From here on; None: as before."""


class Timeline(Generic[K, C]):
    """The instants of the recent past, in order; K is what the filter knows at one of them, C are inputs.

    Args:
        stamp_ns: first instant.
        known: what is known there, before its measurements.
        inputs: from there on.
    """

    def __init__(self, stamp_ns: int, known: K, inputs: C) -> None:
        self._instants: list[Instant[K, C]] = [Instant(stamp_ns, before=known, inputs=inputs)]

    def command(self, stamp_ns: int, inputs: C) -> None:
        """Note the inputs from an instant on; those of the past beyond memory are ignored."""
        if stamp_ns >= self._instants[0].stamp_ns:
            self._at(stamp_ns).inputs = inputs
            self._forget_what_follows(stamp_ns)

    def measure(self, stamp_ns: int, key: tuple[str, str], measurement: object) -> None:
        """Note a measurement; one of the past beyond memory is ignored."""
        if stamp_ns >= self._instants[0].stamp_ns:
            instant = self._at(stamp_ns)
            instant.measured[key] = measurement
            instant.after = None
            self._forget_what_follows(stamp_ns)

    def come_forward(
        self,
        now_ns: int,
        correct: Callable[[K, int, Measured], K],
        predict: Callable[[K, C | None, int], K],
    ) -> K:
        """What is known at ``now_ns``, its measurements included.

        Args:
            now_ns: not before any instant noted.
            correct: (known, stamp [ns], measurements) -> known after the measurements of the same instant.
            predict: (known, inputs meanwhile or None: as before, duration [ns]) -> known then.
        """
        self._at(now_ns)
        newest = max(i for i, each in enumerate(self._instants) if each.before is not None)
        self._correct(self._instants[newest], correct)
        for instant, following in pairwise(self._instants[newest:]):
            assert instant.after is not None
            duration_ns = following.stamp_ns - instant.stamp_ns
            following.before = predict(instant.after, instant.inputs, duration_ns)
            self._correct(following, correct)
        known = self._instants[-1].after
        assert known is not None
        return known

    def forget(self, before_ns: int) -> None:
        """Forget the instants before one; the newest instant stays."""
        while len(self._instants) > 1 and self._instants[0].stamp_ns < before_ns:
            del self._instants[0]

    def _correct(self, instant: Instant[K, C], correct: Callable[[K, int, Measured], K]) -> None:
        if instant.after is None:
            assert instant.before is not None
            instant.after = correct(instant.before, instant.stamp_ns, instant.measured)

    def _at(self, stamp_ns: int) -> Instant[K, C]:
        """The instant with this stamp, a new one if needed."""
        if self._instants[-1].stamp_ns == stamp_ns:
            return self._instants[-1]
        index = bisect_left(self._instants, stamp_ns, key=lambda instant: instant.stamp_ns)
        if index == len(self._instants) or self._instants[index].stamp_ns != stamp_ns:
            self._instants.insert(index, Instant(stamp_ns))
            self._forget_what_follows(stamp_ns)
        return self._instants[index]

    def _forget_what_follows(self, stamp_ns: int) -> None:
        for instant in reversed(self._instants):
            if instant.stamp_ns <= stamp_ns:
                return
            instant.before = instant.after = None
