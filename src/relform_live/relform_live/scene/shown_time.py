"""Which simulation time the view shows at a wall time, so that motion is even.

Messages arrive in bursts, and their instants are further apart than the frames of the view. So the view is
a little behind the newest message and moves evenly: a line through the recent arrivals says how simulation
time runs over wall time.
"""

from collections import deque

import numpy as np

from relform_core.units import NANOSECONDS_PER_SECOND

WINDOW = 40
"""Arrivals through which the line is fitted."""
SILENCE_S = 2.0
"""After this time without a message simulation time counts as standing still."""
DELAY_INTERVALS = 1.5
"""How far the view is behind, in intervals between arrivals."""


class ShownTime:
    """The simulation time to show."""

    def __init__(self) -> None:
        self._arrivals: deque[tuple[float, int]] = deque(maxlen=WINDOW)
        self._shown_ns: int | None = None

    def arrived(self, stamp_ns: int, now: float) -> None:
        """Note the newest stamp of the messages at a wall time [s]."""
        if self._arrivals:
            newest = self._arrivals[-1][1]
            if stamp_ns == newest:
                return
            if stamp_ns < newest:  # another flight, or a jump back
                self._arrivals.clear()
                self._shown_ns = None
        self._arrivals.append((now, stamp_ns))

    def at(self, now: float) -> int | None:
        """Simulation time to show at a wall time [s]: [ns], never less than before; None: nothing arrived."""
        if not self._arrivals:
            return None
        walls, stamps = (np.array(each, dtype=np.float64) for each in zip(*self._arrivals, strict=True))
        newest = self._arrivals[-1][1]
        shown = newest
        from_mean, behind = walls - walls.mean(), stamps - newest
        if (spread := float(from_mean @ from_mean)) > 0.0:  # else all came in one burst
            rate = from_mean @ behind / spread
            interval = (stamps[-1] - stamps[0]) / (len(stamps) - 1)
            line = behind.mean() + rate * (now - walls.mean())
            shown = newest + round(line - DELAY_INTERVALS * interval)
        self._shown_ns = min(newest, max(shown, self._shown_ns or 0))
        return self._shown_ns

    def rate(self, now: float) -> float | None:
        """Simulation time by wall time at a wall time [s]; 0 if nothing arrives; None: not known yet."""
        if len(self._arrivals) < 2:
            return None
        (first, first_ns), (last, last_ns) = self._arrivals[0], self._arrivals[-1]
        if now > last + SILENCE_S:
            return 0.0
        return (last_ns - first_ns) / NANOSECONDS_PER_SECOND / max(last - first, 1e-9)
