"""The time of a flight in real time, at one node."""

import time
from collections import deque
from collections.abc import Callable

from relform_core.units import NANOSECONDS_PER_SECOND

REMEMBERED_TICKS = 8
"""Of so many ticks the one that came fastest tells the time: several, because a tick may be late, and few,
because the clock may hold the next ones back for good."""


class FlightTime:
    """Instants of the flight [ns], from the ticks of its clock and the steady clock of this machine.

    The tick of step k tells that k periods have passed. Its way takes time, and sometimes much: so the tick
    that came earliest for its step counts, of the last ones. The time lags by the shortest way of a tick.

    Args:
        now_ns: steady time, that of ``time.monotonic`` [ns].
    """

    def __init__(self, period_ns: int, now_ns: Callable[[], int] = time.monotonic_ns) -> None:
        self._period_ns = period_ns
        self._now_ns = now_ns
        self._starts: deque[int] = deque(maxlen=REMEMBERED_TICKS)
        """Of the flight by each tick, on the steady clock [ns]."""
        self._start_ns = 0

    def tick(self, step: int) -> None:
        """The tick of a step has arrived."""
        self._starts.append(self._now_ns() - step * self._period_ns)
        self._start_ns = min(self._starts)

    def now_ns(self) -> int:
        """The present instant of the flight [ns]; 0 before the first tick."""
        return self._now_ns() - self._start_ns if self._starts else 0

    def steady(self, instant_ns: int) -> float:
        """An instant of the flight on the steady clock [s]."""
        return (self._start_ns + instant_ns) / NANOSECONDS_PER_SECOND
