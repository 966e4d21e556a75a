"""The recent course of some numbers, as a plot draws it."""

import numpy as np

from relform_core.arrays import Array
from relform_core.units import NANOSECONDS_PER_SECOND

POINTS = 200
SPACING_NS = NANOSECONDS_PER_SECOND // 10


class History:
    """The newest values of some series over time; NaN where there are none yet."""

    def __init__(self, n_series: int) -> None:
        self._columns = np.empty((1 + n_series, POINTS))
        self._last_ns: int | None = None
        self._clear(0)

    def add(self, stamp_ns: int, *values: float) -> None:
        """Add one value per series, unless it is too close in time to the one before.

        A time before that of the last values is of another flight, or after a jump: the series begin again.
        """
        if self._last_ns is None or stamp_ns < self._last_ns:
            self._clear(stamp_ns)
        elif stamp_ns < self._last_ns + SPACING_NS:
            return
        self._columns[:, :-1] = self._columns[:, 1:]
        self._columns[:, -1] = stamp_ns / NANOSECONDS_PER_SECOND, *values
        self._last_ns = stamp_ns

    def _clear(self, stamp_ns: int) -> None:
        self._columns[:] = np.nan
        self._columns[0] = (stamp_ns + SPACING_NS * np.arange(-POINTS, 0)) / NANOSECONDS_PER_SECOND

    @property
    def columns(self) -> tuple[Array, ...]:
        """Time [s], then the series, each of shape (point,)."""
        return tuple(column.copy() for column in self._columns)
