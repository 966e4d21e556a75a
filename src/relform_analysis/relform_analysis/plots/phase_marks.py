"""The phases of a flight in a plot over time, and the errors that are too large for it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from relform_analysis.flight.log import FlightLog
from relform_analysis.flight.phases import flown_phases
from relform_analysis.plots.steady_scale import SteadyScale
from relform_analysis.plots.style import BAND, GUIDE, TEXT
from relform_core.arrays import Array

if TYPE_CHECKING:  # matplotlib takes a second to import
    from matplotlib.axes import Axes


def shade_phases(axes: Axes, log: FlightLog) -> None:
    """Mark where phases begin, and shade their steady windows."""
    phases = flown_phases(log)
    for phase in phases:
        axes.axvspan(phase.steady, phase.end, color=BAND, linewidth=0, zorder=0)
        axes.axvline(phase.start, color=GUIDE, linewidth=0.6)
    axes.set_xlim(phases[0].start, phases[-1].end)


def name_phases(axes: Axes, log: FlightLog) -> None:
    """Write the names of the phases above a plot."""
    above = axes.get_xaxis_transform()
    for phase in flown_phases(log):
        axes.text(phase.middle, 1.03, phase.name, transform=above, ha="center", color=TEXT, fontweight="bold")


def name_peaks(axes: Axes, scale: SteadyScale, time: Array) -> None:
    """Write how high the errors are where they leave a plot; ``time`` of the control steps, shape (K,)."""
    for peak in scale.shown_peaks(time):
        axes.annotate(
            f"▲ {peak.value:.3g}",
            (time[peak.step], scale.top),
            xytext=(4.0, -1.0),
            textcoords="offset points",
            va="top",
            color=TEXT,
            bbox={"boxstyle": "square,pad=0.15", "facecolor": "white", "edgecolor": "none", "alpha": 0.85},
        )
