"""The figure of the ablations: a row per variant, a column per number."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from relform_analysis.evaluation.claims import of_variant
from relform_analysis.evaluation.plan import STRUCTURES, TUNINGS, WARM_STARTS
from relform_analysis.flight.summary import Json
from relform_analysis.plots.over_time import DPI, WIDTH_IN
from relform_analysis.plots.style import BAND, BLUE, GUIDE, TEXT, VERMILION

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

ROW_IN, TOP_IN, BOTTOM_IN = 0.2, 0.45, 0.55
LABELS, COUNTS = 0.36, 0.41
"""Right ends of the titles and of the counts, as parts of the width."""
NOTE = (
    "Mean (dot) and range (line) of the completed flights, errors in steady state; dashed: the whole "
    "method.\nOrange: flights were lost. Centres of vehicles that are 0.5 m apart count as a collision."
)
GROUPS = (WARM_STARTS, STRUCTURES[1:], TUNINGS[1:])
"""Perfect sensors are off all scales; the tables have them."""


@dataclass(frozen=True)
class Column:
    """One number of each variant."""

    key: str
    title: str
    ticks: tuple[float, ...]
    log_scale: bool = True


COLUMNS = (
    Column("steady_mean_m", "formation\nerror [m]", (0.1, 0.5)),
    Column("leader_steady_mean_m", "leader\nerror [m]", (0.1, 1.0)),
    Column("follower_yaw_steady_mean_deg", "follower\nyaw [deg]", (1.0, 10.0)),
    Column("kkt_first_median", "KKT value,\nfirst step", (300.0, 2000.0)),
    Column("separation_min_m", "least sepa-\nration [m]", (0.5, 0.75), log_scale=False),
)


def draw_ablation(variants: Sequence[Json]) -> Figure:
    """Mean and range of each number over the completed flights; dashed: the whole method."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    rows: list[Json | None] = []
    for group in GROUPS:
        rows += [of_variant(variants, name) for name in group] + [None]
    rows.pop()
    height = ROW_IN * len(rows) + TOP_IN + BOTTOM_IN
    figure = Figure(figsize=(WIDTH_IN, height), dpi=DPI)
    FigureCanvasAgg(figure)
    figure.subplots_adjust(
        left=COUNTS + 0.02, right=0.98, bottom=BOTTOM_IN / height, top=1.0 - TOP_IN / height, wspace=0.15
    )
    panels = figure.subplots(1, len(COLUMNS), sharey=True)
    for axes, column in zip(panels, COLUMNS, strict=True):
        _draw_column(axes, column, rows)
    _write_titles(figure, panels[0], rows)
    figure.text(0.05 / WIDTH_IN, 0.05 / height, NOTE, color=TEXT, va="bottom", linespacing=1.3)
    return figure


def _write_titles(figure: Figure, axes: Axes, rows: Sequence[Json | None]) -> None:
    def write(part: float, row: float, text: str, colour: str) -> None:
        across = figure.transFigure.transform((part, 0.0))[0]
        x = axes.transAxes.inverted().transform((across, 0.0))[0]
        transform = axes.get_yaxis_transform()
        axes.text(x, row, text, transform=transform, ha="right", va="center", color=colour, clip_on=False)

    write(COUNTS, -1.0, "completed", TEXT)
    for row, variant in enumerate(rows):
        if variant is not None:
            colour = TEXT if variant["completed"] == variant["runs"] else VERMILION
            write(LABELS, row, variant["title"], colour)
            write(COUNTS, row, f"{variant['completed']}/{variant['runs']}", colour)


def _draw_column(axes: Axes, column: Column, rows: Sequence[Json | None]) -> None:
    for row, variant in enumerate(rows):
        if variant is None:
            continue
        axes.axhline(row, color=BAND, linewidth=0.8, zorder=0)
        distribution = variant["metrics"].get(column.key)
        if distribution and distribution["mean"] is not None:
            axes.plot([distribution["min"], distribution["max"]], [row, row], color=BLUE, linewidth=1.0)
            axes.plot(distribution["mean"], row, "o", color=BLUE, markersize=3.5)
    complete = rows[0]["metrics"].get(column.key) if rows[0] else None
    if complete and complete["mean"] is not None:
        axes.axvline(complete["mean"], color=GUIDE, linewidth=0.8, linestyle="--", zorder=1)
    if column.log_scale:
        axes.set_xscale("log")
    axes.set_xticks(column.ticks, [f"{tick:g}" for tick in column.ticks])
    axes.tick_params(axis="x", which="minor", labelbottom=False)
    axes.set_title(column.title, loc="left", color=TEXT)
    axes.set_ylim(len(rows) - 0.5, -0.5)
    axes.set_yticks([])
    axes.spines["left"].set_visible(False)
