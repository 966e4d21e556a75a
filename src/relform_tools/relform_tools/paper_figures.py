"""The figures of the paper's section V in its form: of one flight, or mean and deviation over many."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from relform_core.errors import RelformError
from relform_tools.figures import (
    GUIDE,
    PAIR_COLOURS,
    TEXT,
    VEHICLE_COLOURS,
    cycled,
    name_phases,
    shade_phases,
)
from relform_tools.flight_log import FlightLog, Floats
from relform_tools.flown_phases import flown_phases, step_times
from relform_tools.panels import Line, Panel, flight_panels

if TYPE_CHECKING:  # matplotlib takes a second to import, which only who draws should wait for
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WIDTH_IN, ROW_IN = 7.0, 1.4
"""Two columns of a paper, and the height of a plot with its title."""
LEFT_IN, RIGHT_IN, TOP_IN, BOTTOM_IN, TITLE_IN = 0.6, 0.1, 0.4, 0.4, 0.25
"""Margins of a figure, and between its plots."""
DPI = 200
STYLE = {
    "font.size": 8.0,
    "axes.titlesize": 8.0,
    "axes.titlelocation": "right",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "legend.frameon": False,
    "legend.fontsize": 7.0,
    "pdf.fonttype": 42,  # text stays text
}
COLOURS = {
    "vehicle": VEHICLE_COLOURS,
    "pair": PAIR_COLOURS,
    "rotor": ("#D55E00", "#0072B2", "#009E73", "#CC79A7"),
    "series": ("#222222", "#D55E00"),
}
PHASE_NAMES_PT = 11.0
DENSE_LINES = 3
"""More than so many lines in one plot are thin."""


def draw_paper_figures(logs: Sequence[FlightLog], folder: Path) -> list[Path]:
    """Draw every figure, as PNG and as PDF.

    Args:
        logs: one or more flights of one scenario. One that ended early counts in what it flew.
        folder: where they go; made if it is not there.
    Returns:
        The files.
    Raises:
        RelformError: a file cannot be written.
    """
    import matplotlib
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    longest = max(logs, key=lambda log: len(log.phase))
    files = []
    with matplotlib.rc_context(STYLE):  # type: ignore[arg-type]  # its keys are literals
        for name, panels in _figures(logs).items():
            height = ROW_IN * len(panels) + TOP_IN + BOTTOM_IN
            figure = Figure(figsize=(WIDTH_IN, height), dpi=DPI)
            FigureCanvasAgg(figure)
            _draw_panels(figure, panels, longest)
            files += _save(figure, folder, name)
        figure = Figure(figsize=(WIDTH_IN, 0.6 * WIDTH_IN), dpi=DPI)
        FigureCanvasAgg(figure)
        _draw_trajectories(figure, logs)
        files += _save(figure, folder, "trajectories_3d")
    return files


def over_runs(series: Sequence[Floats]) -> tuple[Floats, Floats]:
    """Mean and standard deviation over flights, at each control step over those that got there.

    Args:
        series: per flight one value per control step, shape (K,); K may differ.
    Returns:
        Mean and deviation, shape (K of the longest,); NaN where no flight has a value.
    """
    stack = np.full((len(series), max(map(len, series))), np.nan)
    for run, values in enumerate(series):
        stack[run, : len(values)] = values
    known = np.ma.masked_invalid(stack)
    return known.mean(axis=0).filled(np.nan), known.std(axis=0).filled(np.nan)


def _figures(logs: Sequence[FlightLog]) -> dict[str, list[list[Panel]]]:
    """By figure and plot: that plot of every flight; as in the paper, each pair has its own."""
    runs = [flight_panels(log) for log in logs]
    for run in runs:
        (formation,) = run["formation_errors"]
        run["formation_errors"] = [
            replace(formation, title=f"Formation error, {line.name}", lines=[line])
            for line in formation.lines
        ]
    return {
        name: [list(panels) for panels in zip(*(run[name] for run in runs), strict=True)] for name in runs[0]
    }


def _draw_panels(figure: Figure, panels: Sequence[Sequence[Panel]], longest: FlightLog) -> None:
    width, height = figure.get_size_inches()
    figure.subplots_adjust(
        left=LEFT_IN / width,
        right=1.0 - RIGHT_IN / width,
        bottom=BOTTOM_IN / height,
        top=1.0 - TOP_IN / height,
        hspace=TITLE_IN / (ROW_IN - TITLE_IN),
    )
    rows = figure.subplots(len(panels), 1, sharex=True, squeeze=False)[:, 0]
    for axes, panel in zip(rows, panels, strict=True):
        shade_phases(axes, longest)
        _draw_panel(axes, panel, step_times(longest))
        _write_heading(axes, panel[0], above=PHASE_NAMES_PT if axes is rows[0] else 0.0)
    name_phases(rows[0], longest)
    rows[-1].set_xlabel("time [s]")


def _draw_panel(axes: Axes, panel: Sequence[Panel], time: Floats) -> None:
    """One plot, given as that plot of every flight."""
    first = panel[0]
    width = 0.5 if len(first.lines) > DENSE_LINES else 0.9
    for index, line in enumerate(first.lines):
        mean, deviation = over_runs([each.lines[index].values for each in panel])
        if len(panel) > 1:
            axes.fill_between(
                time, mean - deviation, mean + deviation, color=_colour(line), alpha=0.25, linewidth=0
            )
        axes.plot(time, mean, color=_colour(line), linewidth=width, label=line.name)
    for guide in first.guides:
        for level in guide.values:
            axes.axhline(level, color=GUIDE, linestyle="--", linewidth=0.8, label=guide.label)
    if first.log_scale:
        axes.set_yscale("log")
        _label_log_scale(axes)
    else:
        axes.set_ylim(bottom=0.0)
    axes.set_ylabel(f"[{first.unit}]" if first.unit else "")
    axes.yaxis.set_label_coords(-0.06, 0.5)


def _write_heading(axes: Axes, panel: Panel, above: float) -> None:
    """Title and legend over a plot, ``above`` points higher than usual."""
    axes.set_title(panel.title, color=TEXT, pad=3.0 + above)
    handles = {label: handle for handle, label in zip(*axes.get_legend_handles_labels(), strict=True)}
    if len(panel.lines) == 1:
        handles.pop(panel.lines[0].name)  # the title names it
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


def _draw_trajectories(figure: Figure, logs: Sequence[FlightLog]) -> None:
    """All flights; the first one with its reference and the names of its phases."""
    axes: Any = figure.add_axes((0.0, 0.0, 1.0, 1.0), projection="3d", computed_zorder=False)
    first = logs[0]
    for run, log in enumerate(logs):
        width = 1.0 if run == 0 else 0.4
        for vehicle, name in enumerate(log.vehicles):
            label = name if run == 0 else None
            axes.plot(
                *log.p_NB_N[:, vehicle].T,
                color=cycled(VEHICLE_COLOURS, vehicle),
                linewidth=width,
                label=label,
            )
    reference = {"color": GUIDE, "linewidth": 0.9, "linestyle": (0, (4, 3))}
    axes.plot(*first.leader_p_NB_N__ref.T, **reference, label="leader's reference")
    time, above = step_times(first), {"fontweight": "bold", "ha": "center", "zorder": 5}
    for phase in flown_phases(first):
        x, y, z = first.p_NB_N[first.tick_of_step[np.searchsorted(time, phase.middle)], 0]
        axes.text(x, y, z + 0.8, phase.name, **above)
    axes.set(xlabel="x [m]", ylabel="y [m]", zlabel="z [m]")
    axes.set_zlim(bottom=0.0)
    limits = np.array([axes.get_xlim(), axes.get_ylim(), axes.get_zlim()])
    axes.set_box_aspect(np.ptp(limits, axis=1), zoom=1.15)
    axes.view_init(elev=25.0, azim=-50.0)
    axes.legend(loc="upper left")


def _colour(line: Line) -> str:
    palette, _, index = line.colour.partition("-")
    return cycled(COLOURS[palette], int(index))


def _save(figure: Figure, folder: Path, name: str) -> list[Path]:
    files = [folder / f"{name}.png", folder / f"{name}.pdf"]
    try:
        folder.mkdir(parents=True, exist_ok=True)
        figure.savefig(files[0])
        figure.savefig(files[1], metadata={"CreationDate": None})  # the same flight, the same file
    except OSError as error:
        raise RelformError(f"{folder}: figures cannot be written there: {error.strerror}") from None
    return files
