"""The figures of the paper's section V in its form: of one flight, or mean and deviation over many."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import ceil
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from relform_analysis.flight.log import FlightLog
from relform_analysis.flight.phases import flown_phases
from relform_analysis.flight.tracking_errors import scored_pairs
from relform_analysis.plots.flight_picture import FORMATION_EVERY_S
from relform_analysis.plots.over_time import DPI, NOTE_LINE_IN, WIDTH_IN, draw_over_time, save
from relform_analysis.plots.palette import vehicle_style
from relform_analysis.plots.panels import Panel, flight_panels
from relform_analysis.plots.style import GUIDE, PAPER_STYLE, TEXT, line_style
from relform_core.units import NANOSECONDS_PER_SECOND

if TYPE_CHECKING:
    from matplotlib.figure import Figure

TRAJECTORIES = "trajectories_3d"
PAIRS_APART = 3
"""More pairs than those of the paper's team share one plot."""
LEGEND_COLUMNS = 5
LEGEND_LINE_IN = 0.18
SCENE_IN, SCENE_LIFT_IN = 3.8, 0.2
"""Height of the 3D scene, and lift of its middle, which makes room for the labels below."""


def draw_paper_figures(logs: Sequence[FlightLog], folder: Path) -> list[Path]:
    """Draw every figure, as PNG and as PDF.

    Args:
        logs: one or more flights of one scenario. A flight that ended early counts as far as it flew.
        folder: of the files; created if needed.
    Returns:
        The files.
    Raises:
        RelformError: a file cannot be written.
    """
    import matplotlib

    longest = max(logs, key=lambda log: len(log.phase))
    runs = [pair_by_pair(flight_panels(log)) for log in logs]
    files = []
    with matplotlib.rc_context(PAPER_STYLE):
        for name in runs[0]:
            files += save(draw_over_time([run[name] for run in runs], longest), folder, name)
        files += save(draw_trajectories(logs), folder, TRAJECTORIES)
    return files


def pair_by_pair(figures: dict[str, list[Panel]]) -> dict[str, list[Panel]]:
    """The plots of a flight with one for each pair, as in the paper; many pairs share one plot."""
    (formation,) = figures["formation_errors"]
    if len(formation.lines) > PAIRS_APART:
        return figures
    pairs = [
        replace(formation, title=f"Formation error, {line.name}", lines=[line]) for line in formation.lines
    ]
    return figures | {"formation_errors": pairs}


def draw_trajectories(logs: Sequence[FlightLog], note: str = "") -> Figure:
    """The paths of all flights; of the first one also the reference, the formation and the phases."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from mpl_toolkits.mplot3d.art3d import Line3DCollection

    first = logs[0]
    note_in = NOTE_LINE_IN * len(note.splitlines())
    legend_in = LEGEND_LINE_IN * ceil((len(first.vehicles) + 1) / LEGEND_COLUMNS)
    height = SCENE_IN + note_in + legend_in
    figure = Figure(figsize=(WIDTH_IN, height), dpi=DPI)
    FigureCanvasAgg(figure)
    axes: Any = figure.add_axes(
        (0.0, (note_in + SCENE_LIFT_IN) / height, 1.0, SCENE_IN / height),
        projection="3d",
        computed_zorder=False,
    )
    for run, log in enumerate(logs):
        for vehicle, name in enumerate(log.vehicles):
            path = {**line_style(vehicle_style(vehicle)), "linewidth": 1.0 if run == 0 else 0.3}
            axes.plot(*log.p_NB_N[:, vehicle].T, **path, label=name if run == 0 else None)
    instants = np.arange(first.tick_ns[0], first.tick_ns[-1] + 1, FORMATION_EVERY_S * NANOSECONDS_PER_SECOND)
    shown = first.p_NB_N[np.searchsorted(first.tick_ns, instants)]
    scored = [
        [first.vehicles.index(name) for name in pair] for pair in scored_pairs(first.scenario.config.team)
    ]
    links = [places[pair] for places in shown for pair in scored]
    axes.add_collection3d(Line3DCollection(links, colors=GUIDE, linewidths=0.4))
    reference = {"color": GUIDE, "linewidth": 0.9, "linestyle": (0, (4, 3))}
    axes.plot(*first.leader_p_NB_N__ref.T, **reference, label="leader's reference")
    above = {"fontweight": "bold", "ha": "center", "zorder": 5}
    for phase in flown_phases(first):
        x, y, z = first.p_NB_N[phase.tick_in_the_middle(first), first.leader]
        axes.text(x, y, z + 0.8, phase.name, **above)
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]", labelpad=8.0)
    axes.set_zlabel("z [m]")
    axes.set_zlim(bottom=0.0)
    limits = np.array([axes.get_xlim(), axes.get_ylim(), axes.get_zlim()])
    axes.set_box_aspect(np.ptp(limits, axis=1), zoom=1.3)
    axes.view_init(elev=25.0, azim=-50.0)
    figure.legend(
        *axes.get_legend_handles_labels(), loc="upper left", ncols=LEGEND_COLUMNS, labelspacing=0.25
    )
    if note:
        figure.text(0.05 / WIDTH_IN, 0.05 / height, note, color=TEXT, va="bottom", linespacing=1.3)
    return figure
