"""Plots over time for papers: of one flight, or mean and standard deviation over many."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from relform_analysis.flight.log import FlightLog
from relform_analysis.flight.metrics import steady_steps
from relform_analysis.flight.phases import step_times
from relform_analysis.plots.headings import Heading, draw_heading, heading_height_in
from relform_analysis.plots.palette import Style, series_style
from relform_analysis.plots.panels import Panel
from relform_analysis.plots.phase_marks import name_peaks, name_phases, shade_phases
from relform_analysis.plots.steady_scale import ROOM, TICKS, SteadyScale, steady_scale
from relform_analysis.plots.style import BAND, GUIDE, TEXT, line_style
from relform_core.arrays import Array
from relform_core.errors import RelformError

if TYPE_CHECKING:  # matplotlib takes a second to import
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WIDTH_IN = 7.0
"""Two columns of a paper."""
PLOT_IN, TALL_IN = 1.15, 2.6
"""Height of a plot, and of one with many errors."""
LEFT_IN, RIGHT_IN, TOP_IN, BOTTOM_IN = 0.6, 0.1, 0.05, 0.4
"""Margins of a figure."""
PHASES_IN = 0.16
"""Height of the names of the phases, which are above the first plot."""
GAP_IN = 0.1
"""Between a plot and the heading of the next one."""
NOTE_LINE_IN = 0.155
DPI = 200
DENSE_LINES = 3
"""With more lines than this in one plot, the lines are thin."""
BAND_ALPHA = 0.25


STEADY = "steady state"


@dataclass(frozen=True, eq=False)
class OtherFlights:
    """Flights to draw over the first line of each plot."""

    name: str
    runs: Sequence[Sequence[Panel]]
    """The plots of each flight."""


def draw_over_time(
    runs: Sequence[Sequence[Panel]], longest: FlightLog, compared: OtherFlights | None = None, note: str = ""
) -> Figure:
    """A figure with the same plots of one or more flights, one below the other.

    Args:
        runs: the plots of each flight.
        longest: the flight from which time and phases are taken.
        compared: other flights.
        note: text below.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    plots = [[run[index] for run in runs] for index in range(len(runs[0]))]
    headings = list(_headings(plots, compared))
    heights = [_plot_height_in(panels[0]) for panels in plots]
    note_in = NOTE_LINE_IN * len(note.splitlines())
    above = [heading_height_in(heading) + GAP_IN for heading in headings]
    height = TOP_IN + PHASES_IN + sum(heights) + sum(above) + BOTTOM_IN + note_in
    figure = Figure(figsize=(WIDTH_IN, height), dpi=DPI)
    FigureCanvasAgg(figure)
    top, rows = height - TOP_IN, list[Any]()
    for index, (panels, heading) in enumerate(zip(plots, headings, strict=True)):
        top -= above[index] + heights[index] + (PHASES_IN if index == 0 else 0.0)
        axes = figure.add_axes(
            (
                LEFT_IN / WIDTH_IN,
                top / height,
                1.0 - (LEFT_IN + RIGHT_IN) / WIDTH_IN,
                heights[index] / height,
            ),
            sharex=rows[0] if rows else None,
        )
        rows.append(axes)
        shade_phases(axes, longest)
        scale = _draw_panel(axes, panels, longest)
        if compared is not None:
            others = [run[index].lines[0].values for run in compared.runs]
            _draw_band(axes, others, step_times(longest), panels[0], series_style(1), 0.9)
        if panels[0].log_scale:
            _label_log_scale(axes)
        elif scale is not None:
            name_peaks(axes, scale, step_times(longest))
        draw_heading(axes, heading, heights[index], PHASES_IN if index == 0 else 0.0)
        axes.tick_params(labelbottom=index == len(plots) - 1)
    name_phases(rows[0], longest)
    rows[-1].set_xlabel("time [s]")
    if note:
        figure.text(0.05 / WIDTH_IN, 0.05 / height, note, color=TEXT, va="bottom", linespacing=1.3)
    return figure


def _plot_height_in(panel: Panel) -> float:
    return TALL_IN if panel.is_error and len(panel.lines) > DENSE_LINES else PLOT_IN


def _headings(plots: Sequence[Sequence[Panel]], compared: OtherFlights | None) -> Iterator[Heading]:
    """Title and legend of each plot; what a legend has told is not told again."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    told = set[str]()
    for panels in plots:
        first, entries = panels[0], dict[str, Any]()
        if len(first.lines) > 1 or compared is not None:  # else the title names the line
            lines = [(line.name, line.style) for line in first.lines]
            lines += [] if compared is None else [(compared.name, series_style(1))]
            entries |= {name: Line2D([], [], **line_style(style)) for name, style in lines}
            if compared is not None:  # the same lines in every plot
                entries = {name: entry for name, entry in entries.items() if name not in told}
        flights = max(len(panels), 0 if compared is None else len(compared.runs))
        if flights > 1:
            of_what = " of the logarithm" if first.log_scale else ""
            band = f"band: mean ± standard deviation{of_what}"
            entries |= {} if band in told else {band: Patch(color=TEXT, alpha=BAND_ALPHA, linewidth=0)}
        entries |= {
            guide.label: Line2D([], [], color=GUIDE, linestyle="--", linewidth=0.8) for guide in first.guides
        }
        if STEADY not in told:
            entries[STEADY] = Patch(color=BAND, linewidth=0)
        told |= entries.keys()
        yield Heading(first.title, tuple(entries.values()), tuple(entries))


def over_runs(series: Sequence[Array]) -> tuple[Array, Array]:
    """Mean and standard deviation over flights, at each control step over the flights that reached it.

    Args:
        series: per flight one value per control step, shape (K,); K may differ.
    Returns:
        Mean and deviation of a sample, shape (K of the longest,); NaN where no flight has a value, and the
        deviation also where only one has.
    """
    stack = np.full((len(series), max(map(len, series))), np.nan)
    for run, values in enumerate(series):
        stack[run, : len(values)] = values
    known = np.ma.masked_invalid(stack)
    return known.mean(axis=0).filled(np.nan), known.std(axis=0, ddof=1).filled(np.nan)


def save(figure: Figure, folder: Path, name: str) -> list[Path]:
    """Write a figure as PNG and as PDF.

    Raises:
        RelformError: they cannot be written.
    """
    files = [folder / f"{name}.png", folder / f"{name}.pdf"]
    try:
        folder.mkdir(parents=True, exist_ok=True)
        figure.savefig(files[0])
        figure.savefig(files[1], metadata={"CreationDate": None})  # the same flight gives the same file
    except OSError as error:
        raise RelformError(f"{folder}: figures cannot be written there: {error.strerror}") from None
    return files


def _draw_panel(axes: Axes, panels: Sequence[Panel], longest: FlightLog) -> SteadyScale | None:
    """One plot, given as that plot of every flight; of a linear scale how high it is."""
    first, time = panels[0], step_times(longest)
    width = 0.5 if len(first.lines) > DENSE_LINES else 0.9
    highest = [
        _draw_band(axes, [panel.lines[i].values for panel in panels], time, first, line.style, width)
        for i, line in enumerate(first.lines)
    ]
    levels = [level for guide in first.guides for level in guide.values]
    for level in levels:
        axes.axhline(level, color=GUIDE, linestyle="--", linewidth=0.8)
    axes.set_ylabel(f"[{first.unit}]" if first.unit else "")
    axes.yaxis.set_label_coords(-0.06, 0.5)
    if first.log_scale:
        axes.set_yscale("log")
        return None
    values, level = np.stack(highest, axis=-1), max(levels, default=0.0)
    steady = steady_steps(longest) if first.is_error else np.ones(len(time), dtype=np.bool_)
    scale = steady_scale(values, steady[: len(values)], level)
    if not first.is_error:
        top = max(float(np.nanmax(values, initial=0.0)), level)
        scale = SteadyScale(ROOM * top or 1.0, ())
    axes.set_ylim(0.0, scale.top)
    axes.locator_params(axis="y", nbins=5, min_n_ticks=TICKS)
    return scale


def _draw_band(
    axes: Axes, series: Sequence[Array], time: Array, panel: Panel, style: Style, width: float
) -> Array:
    """A line with a band about it; returns the highest value of both at every step.

    On a logarithmic scale these are mean and deviation of the logarithm.
    """
    if panel.log_scale:
        logarithms = [np.log10(np.where(values > 0.0, values, np.nan)) for values in series]
        mean, deviation = over_runs(logarithms)
        low, middle, high = 10.0 ** (mean - deviation), 10.0**mean, 10.0 ** (mean + deviation)
    else:
        middle, deviation = over_runs(series)
        low, high = middle - deviation, middle + deviation
    drawn = line_style(style)
    if len(series) > 1:
        axes.fill_between(time[: len(low)], low, high, color=drawn["color"], alpha=BAND_ALPHA, linewidth=0)
    axes.plot(time[: len(middle)], middle, **drawn, linewidth=width)
    return np.fmax(middle, high)


def _label_log_scale(axes: Axes) -> None:
    from matplotlib.ticker import LogFormatterSciNotation, LogLocator, NullFormatter

    low, high = axes.get_ylim()
    few = high / low < 100.0
    axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if few else (1.0,)))
    axes.yaxis.set_major_formatter("{x:g}" if few else LogFormatterSciNotation())
    axes.yaxis.set_minor_formatter(NullFormatter())
