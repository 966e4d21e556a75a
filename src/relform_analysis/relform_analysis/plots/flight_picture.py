"""The picture of a flight: the paths of the team, its errors, rotor speeds and solver."""

from __future__ import annotations

import textwrap
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from relform_analysis.flight.log import FlightLog
from relform_analysis.flight.metrics import FlightMetrics, steady_steps
from relform_analysis.flight.paper_claims import FORMATION_STEADY_MEAN_M
from relform_analysis.flight.phases import flown_phases, step_times
from relform_analysis.flight.tracking_errors import formation_errors, leader_errors, scored_pairs
from relform_analysis.plots.palette import vehicle_style
from relform_analysis.plots.panels import pair_label, scored_pair_styles
from relform_analysis.plots.phase_marks import name_peaks, name_phases, shade_phases
from relform_analysis.plots.steady_scale import TICKS, steady_scale
from relform_analysis.plots.style import (
    BAND,
    BLACK,
    GUIDE,
    SCREEN_STYLE,
    SHADOW,
    TEXT,
    VERMILION,
    line_style,
)
from relform_core.arrays import Array
from relform_core.errors import FlightError
from relform_core.units import NANOSECONDS_PER_SECOND, rad_s_to_rpm

if TYPE_CHECKING:  # matplotlib takes a second to import
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

LEFT_COLOUR, RIGHT_COLOUR = BLACK, VERMILION
"""Of the two scales of one panel."""
WIDTH_PX, HEIGHT_PX, DPI = 1600, 1200, 100
SCENE = (0.15, 0.55, 0.63, 0.36)
"""Left, bottom, width and height of the 3D scene in the picture, as parts of it."""
FORMATION_WIDTH = 0.74
"""Of the plot of the formation errors, whose legend is beside it."""
NARROW = 0.8
"""The same with a legend of two columns, as a part of it."""
LEGEND_LINES = 10
REASON_LINE = 34
"""Characters of a line beside the scene."""
PAPER_SCENARIO = "paper"
STEADY_SHADED = "steady state shaded"
GRID_M = 2.0
FORMATION_EVERY_S = 1.0
"""Time between the instants at which the formation is drawn."""


def draw_flight(log: FlightLog, metrics: FlightMetrics, path: Path | str) -> None:
    """Write the picture of a flight, with its key figures, as PNG.

    Raises:
        FlightError: the flight has no control step, or the file cannot be written.
    """
    if not log.phase:
        raise FlightError(f"{path}: not drawn: the flight has no control step")
    import matplotlib

    with matplotlib.rc_context(SCREEN_STYLE):
        figure = flight_figure(log, metrics)
        try:
            figure.savefig(path, format="png")
        except OSError as error:
            raise FlightError(f"{path}: cannot be written: {error.strerror}") from None


def flight_figure(log: FlightLog, metrics: FlightMetrics) -> Figure:
    """The picture of a flight with at least one control step."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(WIDTH_PX / DPI, HEIGHT_PX / DPI), dpi=DPI)
    FigureCanvasAgg(figure)
    _draw_scene(figure, log)
    figure.text(0.02, 0.957, _title(log), fontsize=18, fontweight="bold")
    figure.text(0.02, 0.932, _phase_titles(log), color=TEXT)
    if (end := _early_end(log)) is None:
        _write_key_figures(figure, log, metrics)
    else:
        _write_early_end(figure, end, metrics)
    formation = figure.add_axes((0.05, 0.32, FORMATION_WIDTH, 0.175))
    grid = figure.add_gridspec(1, 3, left=0.05, right=0.955, bottom=0.055, top=0.24, wspace=0.28)
    panels = [formation, *(figure.add_subplot(grid[0, column]) for column in range(3))]
    draws = (_draw_formation, _draw_leader, _draw_rotors, _draw_solver)
    for axes, draw in zip(panels, draws, strict=True):
        draw(axes, log)
        shade_phases(axes, log)
        name_phases(axes, log)
    for axes in panels[1:]:
        axes.set_xlabel("time [s]")
    return figure


def _title(log: FlightLog) -> str:
    config = log.scenario.config
    return f"{config.title}: {len(log.vehicles)} vehicles, seed {log.scenario.seed}"


def _phase_titles(log: FlightLog) -> str:
    return "     ".join(f"{phase.name}  {phase.title}" for phase in log.scenario.config.phases)


def _early_end(log: FlightLog) -> str | None:
    """Why a flight did not reach its end, with the time; None: it did."""
    if log.faults:
        source, reason = log.faults[0].source, log.faults[0].description
        named = reason if source in reason else f"{source}: {reason}"
        return f"ended at {log.flown:.1f} s\n{named}"
    config = log.scenario.config
    reached = int(log.step_ns[-1]) // config.period_ns + 1
    return None if reached >= config.n_steps else f"ends at {log.flown:.1f} s"


def _write_early_end(figure: Figure, end: str, metrics: FlightMetrics) -> None:
    """Errors until a crash mean nothing, so there are none."""
    headline, _, reason = end.partition("\n")
    figure.text(0.98, 0.925, headline, fontsize=22, fontweight="bold", color=VERMILION, ha="right", va="top")
    rest = (textwrap.fill(reason, REASON_LINE), f"smallest separation {metrics.separation_min:.2f} m")
    figure.text(0.98, 0.885, "\n".join(rest), color=TEXT, ha="right", va="top", linespacing=1.4)


def _write_key_figures(figure: Figure, log: FlightLog, metrics: FlightMetrics) -> None:
    score = metrics.score
    headline = f"{score.formation.steady.mean:.3f} m"
    is_paper = log.scenario.config.name == PAPER_SCENARIO
    rest = (
        "mean formation error in steady state",
        f"(the paper: less than {FORMATION_STEADY_MEAN_M} m)\n" if is_paper else "",
        f"leader off its path by {score.leader_position.steady.mean:.3f} m",
        f"and {np.degrees(score.leader_yaw.steady.mean):.1f} deg",
        f"vehicles never closer than {metrics.separation_min:.2f} m",
    )
    figure.text(0.98, 0.925, headline, fontsize=26, fontweight="bold", ha="right", va="top")
    figure.text(0.98, 0.885, "\n".join(rest), color=TEXT, ha="right", va="top", linespacing=1.4)


def _draw_scene(figure: Figure, log: FlightLog) -> None:
    """Paths above the ground, the formation at some instants, and where each phase is."""
    from mpl_toolkits.mplot3d.art3d import Line3DCollection

    # The 3D projection fills the largest square of its axes: these are as high as the picture is wide.
    axes: Any = figure.add_axes(
        (0.0, 0.0, 1.0, WIDTH_PX / HEIGHT_PX), projection="3d", proj_type="ortho", computed_zorder=False
    )
    axes.view_init(elev=22.0, azim=-25.0)
    axes.set_axis_off()

    def draw_lines(lines: list[Any], colour: str, width: float) -> None:
        axes.add_collection3d(Line3DCollection(lines, colors=colour, linewidths=width, zorder=1))

    p_NB_N = log.p_NB_N
    low = np.floor(p_NB_N.min(axis=(0, 1)) / GRID_M - 0.25) * GRID_M
    high = np.ceil(p_NB_N.max(axis=(0, 1)) / GRID_M + 0.25) * GRID_M
    low[2] = 0.0
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    draw_lines(
        [((x, low[1], 0.0), (x, high[1], 0.0)) for x in np.arange(low[0], high[0] + 0.1, GRID_M)], BAND, 1.0
    )
    draw_lines(
        [((low[0], y, 0.0), (high[0], y, 0.0)) for y in np.arange(low[1], high[1] + 0.1, GRID_M)], BAND, 1.0
    )
    figure.text(SCENE[0], SCENE[1], f"grid {GRID_M:.0f} m", color=TEXT)
    axes.plot(*p_NB_N[:, log.leader, :2].T, 0.0, color=SHADOW, linewidth=2.5, zorder=1)

    instants = np.arange(log.tick_ns[0], log.tick_ns[-1] + 1, FORMATION_EVERY_S * NANOSECONDS_PER_SECOND)
    shown = p_NB_N[np.searchsorted(log.tick_ns, instants)]
    draw_lines([(place, place * (1.0, 1.0, 0.0)) for place in shown[:, log.leader]], SHADOW, 0.8)
    pairs = [[log.vehicles.index(name) for name in pair] for pair in scored_pairs(log.scenario.config.team)]
    draw_lines([positions[pair] for positions in shown for pair in pairs], GUIDE, 1.0)
    for vehicle, name in enumerate(log.vehicles):
        style = line_style(vehicle_style(vehicle))
        axes.plot(*p_NB_N[:, vehicle].T, **style, linewidth=1.8, zorder=2, label=name)
        axes.scatter(*shown[:, vehicle].T, color=style["color"], s=24, depthshade=False, zorder=3)
    reference_style = {"color": GUIDE, "linewidth": 1.2, "linestyle": (0, (4, 3))}
    axes.plot(*log.leader_p_NB_N__ref.T, **reference_style, zorder=2, label="leader's reference")
    figure.legend(*axes.get_legend_handles_labels(), loc="upper left", bbox_to_anchor=(0.01, 0.925))

    paper = {"boxstyle": "round,pad=0.1", "facecolor": "white", "edgecolor": "none", "alpha": 0.8}
    for phase in flown_phases(log):
        x, y, z = p_NB_N[phase.tick_in_the_middle(log), log.leader]
        axes.text(
            x, y, z + 0.9, phase.name, fontsize=17, fontweight="bold", ha="center", bbox=paper, zorder=4
        )

    corners = np.array([(x, y, 0.0) for x in (low[0], high[0]) for y in (low[1], high[1])])
    _fit_scene(axes, np.concatenate([p_NB_N.reshape(-1, 3), corners]), high - low)


def _fit_scene(axes: Any, points: Array, box: Array) -> None:
    """Choose zoom and place of a 3D scene such that ``points`` of shape (..., 3) fill ``SCENE``."""
    from mpl_toolkits.mplot3d.proj3d import proj_transform

    axes.set_box_aspect(box)
    x, y, _ = proj_transform(*points.T, axes.get_proj())
    projected = axes.figure.transFigure.inverted().transform(
        axes.transData.transform(np.stack([x, y], axis=-1))
    )
    left, bottom, width, height = SCENE
    zoom = float((np.array([width, height]) / np.ptp(projected, axis=0)).min())
    axes.set_box_aspect(box, zoom=zoom)
    middle = (projected.min(axis=0) + projected.max(axis=0)) / 2.0
    place = axes.get_position()
    centre = np.array([place.x0 + place.x1, place.y0 + place.y1]) / 2.0
    shift = np.array([left + width / 2.0, bottom + height / 2.0]) - (centre + zoom * (middle - centre))
    axes.set_position((place.x0 + shift[0], place.y0 + shift[1], place.width, place.height))


def _draw_formation(axes: Axes, log: FlightLog) -> None:
    pairs = scored_pairs(log.scenario.config.team)
    errors = formation_errors(log, pairs)
    for pair, style, error in zip(pairs, scored_pair_styles(log), errors.T, strict=True):
        axes.plot(step_times(log), error, **line_style(style), label=pair_label(*pair))
    axes.set_title(f"Formation error [m], {STEADY_SHADED}", pad=22.0)
    _scale_errors(axes, log, errors)
    columns = 1 if len(pairs) <= LEGEND_LINES else 2
    axes.legend(
        loc="upper left",
        bbox_to_anchor=(1.005, 1.12),
        ncols=columns,
        borderaxespad=0.0,
        fontsize=12.0 if len(pairs) <= 2 * LEGEND_LINES else 8.0,
        handlelength=1.8,
        columnspacing=0.8,
        labelspacing=0.25,
    )
    if columns > 1:
        left, bottom, width, height = axes.get_position().bounds
        axes.set_position((left, bottom, width * NARROW, height))


def _scale_errors(axes: Axes, log: FlightLog, errors: Array) -> None:
    """The scale of steady state; ``errors`` has the shape (K, ...)."""
    scale = steady_scale(errors.reshape(len(errors), -1), steady_steps(log))
    axes.set_ylim(0.0, scale.top)
    axes.locator_params(axis="y", nbins=5, min_n_ticks=TICKS)
    name_peaks(axes, scale, step_times(log))


def _draw_leader(axes: Axes, log: FlightLog) -> None:
    position_error, yaw_error = leader_errors(log)
    axes.plot(step_times(log), position_error, color=LEFT_COLOUR)
    axes.set_title("Leader: position error [m]", pad=22.0)
    axes.set_ylim(0.0)
    right = _right_scale(axes, "yaw error [deg]")
    right.plot(step_times(log), np.degrees(yaw_error), color=RIGHT_COLOUR)
    right.set_ylim(0.0)


def _draw_rotors(axes: Axes, log: FlightLog) -> None:
    time, speeds, limits = step_times(log), rad_s_to_rpm(1.0) * log.rotor_speeds, log.scenario.config.vehicle
    axes.fill_between(time, speeds.min(axis=(1, 2)), speeds.max(axis=(1, 2)), color=SHADOW, linewidth=0.0)
    for vehicle in range(len(log.vehicles)):
        axes.plot(time, speeds[:, vehicle].mean(axis=-1), **line_style(vehicle_style(vehicle)), linewidth=0.9)
    for limit in (limits.rotor_speed_min, limits.rotor_speed_max):
        axes.axhline(rad_s_to_rpm(limit), color=GUIDE, linestyle="--", linewidth=1.0)
    axes.set_ylim(0.0)
    axes.set_title("Rotor speed [rpm], band: all rotors", pad=22.0)


def _draw_solver(axes: Axes, log: FlightLog) -> None:
    axes.semilogy(step_times(log), log.solver["kkt"], color=LEFT_COLOUR, linewidth=0.9)
    axes.set_title("Solver: KKT value", pad=22.0)
    right = _right_scale(axes, "time per step [ms]")
    step_ms = 1e3 * (log.solver["prepare_time"] + log.solver["feedback_time"])
    right.semilogy(step_times(log), step_ms, color=RIGHT_COLOUR, linewidth=0.9)
    if (measured := step_ms[step_ms > 0.0]).size:  # whole decades, because a part of one gets too many labels
        right.set_ylim(
            10.0 ** np.floor(np.log10(measured.min())), 10.0 ** (np.floor(np.log10(measured.max())) + 1)
        )
    right.yaxis.set_major_formatter("{x:g}")


def _right_scale(axes: Axes, title: str) -> Axes:
    right = axes.twinx()
    right.spines["right"].set(visible=True, color=RIGHT_COLOUR)
    right.tick_params(axis="y", colors=RIGHT_COLOUR)
    right.set_title(title, loc="right", color=RIGHT_COLOUR, pad=22.0)
    return right
