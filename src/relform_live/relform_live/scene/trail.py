"""The way that a vehicle has come, as a line with a fixed number of points."""

import numpy as np

from relform_core.arrays import Array
from relform_core.units import NANOSECONDS_PER_SECOND

POINTS = 150
SPACING_NS = NANOSECONDS_PER_SECOND // 10
"""Least simulation time between two points, so that a trail is at least 15 s long."""


class Trail:
    """The newest points; until there are enough, the first one stands for those that are missing."""

    def __init__(self) -> None:
        self._points = np.zeros((POINTS, 3))
        self._last_ns: int | None = None

    def add(self, stamp_ns: int, p_N: Array) -> None:
        """Add a point [m], shape (3,), unless it is too close in time to the one before."""
        if self._last_ns is None or stamp_ns < self._last_ns:
            self._points[:] = p_N
        elif stamp_ns < self._last_ns + SPACING_NS:
            return
        self._points[:-1] = self._points[1:]
        self._points[-1] = p_N
        self._last_ns = stamp_ns

    def clear(self) -> None:
        """Begin again with the next point."""
        self._last_ns = None

    @property
    def segments(self) -> Array:
        """The line [m], shape (segment, 2, 3), oldest first."""
        return np.stack([self._points[:-1], self._points[1:]], axis=1)
