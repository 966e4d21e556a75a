"""A scale for errors that a few large ones do not flatten: that of steady state."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from relform_core.arrays import Array, Mask

ROOM = 1.05
"""Height of a plot over its highest value."""
OVER_STEADY = 1.5
"""Height of a plot over the highest value in steady state, if it leaves others out."""
FLAT = 2.0
"""A plot leaves values out only if with them it would be this much higher."""
NEAR = 0.07
"""Peaks closer than this have no room for two texts, as a part of the time."""
TICKS = 4
"""A plot has at least so many."""


@dataclass(frozen=True)
class Peak:
    """The largest value of an excursion beyond the scale."""

    step: int
    value: float


@dataclass(frozen=True)
class SteadyScale:
    """The scale of a plot that starts at 0."""

    top: float
    peaks: tuple[Peak, ...]
    """Excursions beyond the top, in order; empty: every value is inside."""

    def shown_peaks(self, time: Array) -> list[Peak]:
        """Those with room for a text: of peaks that are near each other the largest.

        Args:
            time: of the control steps, shape (K,).
        """
        near = NEAR * float(time[-1] - time[0])
        shown: list[Peak] = []
        for peak in sorted(self.peaks, key=lambda peak: -peak.value):
            if all(abs(time[peak.step] - time[other.step]) > near for other in shown):
                shown.append(peak)
        return shown


def steady_scale(values: Array, steady: Mask, level: float = 0.0) -> SteadyScale:
    """The scale of some lines.

    Args:
        values: not negative, NaN: unknown, shape (K, lines).
        steady: whether a control step is in a steady window, shape (K,).
        level: that the plot must reach, as of a guide.
    """
    largest = np.where(np.isfinite(values), values, 0.0).max(axis=1, initial=0.0)
    highest = max(float(largest.max(initial=0.0)), level)
    usual = max(OVER_STEADY * float(largest[steady].max(initial=0.0)), ROOM * level)
    if usual <= 0.0 or ROOM * highest <= FLAT * usual:
        return SteadyScale(ROOM * highest or 1.0, ())
    return SteadyScale(usual, tuple(_peaks(largest, usual)))


def _peaks(largest: Array, top: float) -> Iterator[Peak]:
    """The largest value of each run of steps beyond the top."""
    beyond = np.concatenate([[False], largest > top, [False]])
    edges = np.flatnonzero(beyond[1:] != beyond[:-1])
    for begin, end in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
        step = begin + int(np.argmax(largest[begin:end]))
        yield Peak(step, float(largest[step]))
