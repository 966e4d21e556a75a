"""The picture of docs/constraints.md: scenarios with a soft constraint, flown with and without its price."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon

from relform_analysis.flight.log import FlightLog
from relform_analysis.flight.metrics import separations
from relform_analysis.flight.simulate import fly_in_process
from relform_analysis.flight.view_margins import into_body
from relform_analysis.plots.picture_command import draw_into_file
from relform_analysis.plots.style import BLUE, GUIDE, SHADOW, TEXT, VERMILION
from relform_core.arrays import Array
from relform_core.constraints_config import BoxObstacle, Obstacle, SphereObstacle
from relform_core.load import load_scenario
from relform_core.obstacles import clearance
from relform_core.script import command
from relform_core.units import NANOSECONDS_PER_SECOND

SEED = 1


def separation(log: FlightLog) -> Array:
    """Smallest distance of two vehicles at every instant [m]."""
    return separations(log.p_NB_N)


def off_axis(log: FlightLog) -> Array:
    """Largest angle between the axis of a field of view and its target at every instant [deg]."""
    view = log.scenario.config.controller.constraints.field_of_view
    assert view is not None
    elevation, azimuth = view.axis_elevation, view.axis_azimuth
    axis_B = np.array(
        [np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)]
    )
    angles = []
    for observer, target in view.pairs:
        i, j = log.vehicles.index(observer), log.vehicles.index(target)
        p_BB_B = into_body(log.p_NB_N[:, j] - log.p_NB_N[:, i], log.q_NB[:, i])
        angles.append(np.arccos(p_BB_B @ axis_B / np.linalg.norm(p_BB_B, axis=1)))
    largest: Array = np.degrees(np.max(angles, axis=0))
    return largest


def free_space(log: FlightLog) -> Array:
    """Smallest distance of a vehicle from an obstacle at every instant [m]."""
    nearest: Array = clearance(log.scenario.config.obstacles, log.p_NB_N).min(axis=1)
    return nearest


@dataclass(frozen=True)
class Shown:
    """A scenario, and what of it is drawn over time."""

    scenario: str
    constraint: str
    label: str
    bound: Callable[[Any], float]
    """From the configuration of the constraint, in the unit of the label."""
    values: Callable[[FlightLog], Array]


SHOWN = (
    Shown("crossing", "separation", "separation [m]", lambda config: config.min, separation),
    Shown("gust", "separation", "separation [m]", lambda config: config.min, separation),
    Shown("view", "field_of_view", "off axis [deg]", lambda c: np.degrees(c.half_angle), off_axis),
    Shown("pillar", "keep_out", "from obstacles [m]", lambda config: config.margin, free_space),
)


@command
def main(arguments: Sequence[str] | None = None) -> int:
    """Fly and draw; returns the exit code."""
    description = "Draw flights with and without soft constraints."
    return draw_into_file("constraints", description, lambda: picture(SHOWN), arguments)


def picture(shown: Sequence[Shown]) -> Figure:
    """The paths from above in the first row, what is bounded over time in the second."""
    figure = Figure(figsize=(2.75 * len(shown), 5.0), layout="constrained")
    for column, each in enumerate(shown, 1):
        name = f"controller.constraints.{each.constraint}"
        free = [f"{name}.price_per_unit=1.0e-9", f"{name}.square_price_per_unit2=0.0"]
        held, without = (fly_in_process(load_scenario(each.scenario, set_, SEED)) for set_ in ([], free))
        _draw_paths(figure.add_subplot(2, len(shown), column), each.scenario, held, without)
        axes = figure.add_subplot(2, len(shown), len(shown) + column)
        _draw_over_time(axes, each, held, without)
    return figure


def _draw_paths(axes: Any, title: str, held: FlightLog, without: FlightLog) -> None:
    for log, style in ((without, {"color": GUIDE, "linestyle": "--"}), (held, {"color": BLUE})):
        for vehicle in range(len(log.vehicles)):
            leads = {"color": VERMILION} if vehicle == log.leader and log is held else {}
            axes.plot(*log.p_NB_N[:, vehicle, :2].T, linewidth=1.0, **{**style, **leads})
    axes.scatter(*held.p_NB_N[-1, :, :2].T, color=TEXT, s=12, zorder=3)
    for obstacle in held.scenario.config.obstacles:
        axes.add_patch(_outline(obstacle))
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_title(title)
    axes.set_xlabel("x [m]")


def _outline(obstacle: Obstacle) -> Circle | Polygon:
    """From above."""
    x, y, _ = obstacle.center
    match obstacle:
        case SphereObstacle():
            return Circle((x, y), obstacle.radius, color=SHADOW)
        case BoxObstacle():
            corners = 0.5 * np.array([[1, 1], [1, -1], [-1, -1], [-1, 1]]) * obstacle.size[:2]
            cosine, sine = np.cos(obstacle.yaw), np.sin(obstacle.yaw)
            turned = corners @ np.array([[cosine, sine], [-sine, cosine]])
            return Polygon(turned + (x, y), color=SHADOW)


def _draw_over_time(axes: Any, shown: Shown, held: FlightLog, without: FlightLog) -> None:
    constraint = getattr(held.scenario.config.controller.constraints, shown.constraint)
    axes.axhline(shown.bound(constraint), color=TEXT, linewidth=0.8, linestyle=":", label="bound")
    for log, label, style in (
        (without, "without its price", {"color": GUIDE, "linestyle": "--"}),
        (held, "with it", {"color": BLUE}),
    ):
        time = log.tick_ns / NANOSECONDS_PER_SECOND
        axes.plot(time, shown.values(log), linewidth=1.0, label=label, **style)
    axes.set_xlabel("time [s]")
    axes.set_ylabel(shown.label)
    axes.set_ylim(bottom=0.0)
    axes.legend(frameon=False, fontsize=6.5, loc="best")
