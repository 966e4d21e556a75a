"""Plots over time for papers: of one flight, or mean and standard deviation over many."""

from __future__ import annotations

from collections.abc import Sequence, Set
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from relform_analysis.flight.log import FlightLog
from relform_analysis.flight.phases import step_times
from relform_analysis.plots.palette import Style, series_style
from relform_analysis.plots.panels import Panel
from relform_analysis.plots.phase_marks import name_phases, shade_phases
from relform_analysis.plots.style import GUIDE, TEXT, line_style
from relform_core.arrays import Array
from relform_core.errors import RelformError

if TYPE_CHECKING:  # matplotlib takes a second to import
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WIDTH_IN, ROW_IN = 7.0, 1.4
"""Two columns of a paper, and the height of a plot with its title."""
LEFT_IN, RIGHT_IN, TOP_IN, BOTTOM_IN, TITLE_IN = 0.6, 0.1, 0.4, 0.4, 0.25
"""Margins of a figure, and between its plots."""
NOTE_LINE_IN = 0.14
DPI = 200
PHASE_NAMES_PT = 11.0
DENSE_LINES = 3
"""With more lines than this in one plot, the lines are thin."""
ROOM = 1.05
"""Height of a plot over its highest band; lines of other flights may leave the plot."""


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

    n_plots, note_in = len(runs[0]), NOTE_LINE_IN * len(note.splitlines())
    height = ROW_IN * n_plots + TOP_IN + BOTTOM_IN + note_in
    figure = Figure(figsize=(WIDTH_IN, height), dpi=DPI)
    FigureCanvasAgg(figure)
    figure.subplots_adjust(
        left=LEFT_IN / WIDTH_IN,
        right=1.0 - RIGHT_IN / WIDTH_IN,
        bottom=(BOTTOM_IN + note_in) / height,
        top=1.0 - TOP_IN / height,
        hspace=TITLE_IN / (ROW_IN - TITLE_IN),
    )
    rows = figure.subplots(n_plots, 1, sharex=True, squeeze=False)[:, 0]
    for index, axes in enumerate(rows):
        panels = [run[index] for run in runs]
        shade_phases(axes, longest)
        _draw_panel(axes, panels, step_times(longest))
        if compared is not None:
            others = [run[index].lines[0].values for run in compared.runs]
            _draw_band(axes, others, step_times(longest), panels[0], series_style(1), 0.9, compared.name)
        if panels[0].log_scale:
            _label_log_scale(axes)
        known = {panels[0].lines[0].name} if len(panels[0].lines) == 1 else set()  # the title names it
        if compared is not None:
            known = {panels[0].lines[0].name, compared.name} if index else set()
        _write_heading(axes, panels[0], known, above=PHASE_NAMES_PT if index == 0 else 0.0)
    name_phases(rows[0], longest)
    rows[-1].set_xlabel("time [s]")
    if note:
        figure.text(
            0.05 / WIDTH_IN, 0.05 / height, note, color=TEXT, fontsize=7.0, va="bottom", linespacing=1.3
        )
    return figure


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


def _draw_panel(axes: Axes, panels: Sequence[Panel], time: Array) -> None:
    """One plot, given as that plot of every flight."""
    first = panels[0]
    width = 0.5 if len(first.lines) > DENSE_LINES else 0.9
    highest = [
        _draw_band(
            axes, [panel.lines[i].values for panel in panels], time, first, line.style, width, line.name
        )
        for i, line in enumerate(first.lines)
    ]
    for guide in first.guides:
        for level in guide.values:
            axes.axhline(level, color=GUIDE, linestyle="--", linewidth=0.8, label=guide.label)
    if first.log_scale:
        axes.set_yscale("log")
    else:
        levels = [level for guide in first.guides for level in guide.values]
        top = max((value for value in (*highest, *levels) if np.isfinite(value)), default=0.0)
        axes.set_ylim(0.0, ROOM * top or 1.0)
    axes.set_ylabel(f"[{first.unit}]" if first.unit else "")
    axes.yaxis.set_label_coords(-0.06, 0.5)


def _draw_band(
    axes: Axes, series: Sequence[Array], time: Array, panel: Panel, style: Style, width: float, name: str
) -> float:
    """A line with a band about it; returns the highest value of both.

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
        axes.fill_between(time[: len(low)], low, high, color=drawn["color"], alpha=0.25, linewidth=0)
    axes.plot(time[: len(middle)], middle, **drawn, linewidth=width, label=name)
    highest = np.fmax(middle, high)
    finite = highest[np.isfinite(highest)]
    return float(finite.max()) if finite.size else np.nan


def _write_heading(axes: Axes, panel: Panel, known: Set[str], above: float) -> None:
    """Title of a plot, and legend without the ``known`` labels, ``above`` points higher than usual."""
    axes.set_title(panel.title, color=TEXT, pad=3.0 + above)
    handles = {
        label: handle
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True)
        if label not in known
    }
    if handles:
        bottom = 1.0 + above / 72.0 / (ROW_IN - TITLE_IN)
        axes.legend(
            handles.values(),
            handles.keys(),
            loc="lower left",
            bbox_to_anchor=(0.0, bottom),
            ncols=len(handles),
            borderaxespad=0.0,
            borderpad=0.2,
            columnspacing=1.2,
        )


def _label_log_scale(axes: Axes) -> None:
    from matplotlib.ticker import LogFormatterSciNotation, LogLocator, NullFormatter

    low, high = axes.get_ylim()
    few = high / low < 100.0
    axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if few else (1.0,)))
    axes.yaxis.set_major_formatter("{x:g}" if few else LogFormatterSciNotation())
    axes.yaxis.set_minor_formatter(NullFormatter())
