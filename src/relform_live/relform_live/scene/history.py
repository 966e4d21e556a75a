"""The recent course of some numbers, as a plot draws it."""

from collections import deque

import numpy as np

from relform_core.arrays import Array
from relform_core.units import NANOSECONDS_PER_SECOND

LENGTH_S = 20.0
POINTS = 161
SPACING_NS = NANOSECONDS_PER_SECOND // 10


class History:
    """The newest values of some series over time."""

    def __init__(self, n_series: int) -> None:
        self._times: deque[float] = deque(maxlen=round(LENGTH_S * NANOSECONDS_PER_SECOND / SPACING_NS))
        self._rows: deque[tuple[float, ...]] = deque(maxlen=self._times.maxlen)
        self._n_series = n_series
        self._last_ns: int | None = None

    def add(self, stamp_ns: int, *values: float) -> None:
        """Add one value per series, unless it is too close in time to the one before.

        A time before that of the last values is of another flight, or after a jump: the series begin again.
        """
        if self._last_ns is not None and 0 <= stamp_ns - self._last_ns < SPACING_NS:
            return
        if self._last_ns is not None and stamp_ns < self._last_ns:
            self._times.clear()
            self._rows.clear()
        self._times.append(stamp_ns / NANOSECONDS_PER_SECOND)
        self._rows.append(values)
        self._last_ns = stamp_ns

    @property
    def columns(self) -> tuple[Array, ...]:
        """Time before the newest value [s], then the series, interpolated, each of shape (POINTS,).

        Until the series are long enough, their first values stand at the beginning several times, because the
        plot cannot draw NaN.
        """
        if not self._times:
            return tuple(np.zeros((1 + self._n_series, POINTS)))
        times = np.array(self._times) - self._times[-1]
        ago = np.maximum(np.linspace(-LENGTH_S, 0.0, POINTS), times[0])
        return ago, *(np.interp(ago, times, each) for each in np.array(self._rows).T)
