"""The picture of docs/scenarios.md: every shape of a formation, and every sensing graph."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from relform_analysis.plots.picture_command import draw_into_file
from relform_analysis.plots.style import BLUE, GUIDE, SHADOW, TEXT, VERMILION
from relform_core import sensing_graph, shapes
from relform_core.arrays import Array
from relform_core.script import command
from relform_core.sensing_graph import Edges

N_VEHICLES = 9
SPACING = 1.0
"""[m]"""
OPENING = np.radians(90.0)
_COLUMNS = 6


@command
def main(arguments: Sequence[str] | None = None) -> int:
    """Draw the picture; returns the exit code."""
    description = "Draw the shapes of formations and sensing graphs."
    return draw_into_file("shapes", description, lambda: picture(N_VEHICLES), arguments)


def picture(n_vehicles: int) -> Figure:
    """Shapes in the first row, graphs in the second; all but the sphere from above."""
    by_kind = {
        "line": shapes.line(n_vehicles, SPACING),
        "column": shapes.column(n_vehicles, SPACING),
        "v": shapes.v(n_vehicles, SPACING, OPENING),
        "circle": shapes.circle(n_vehicles, SPACING),
        "grid": shapes.grid(n_vehicles, SPACING),
        "sphere": shapes.sphere(n_vehicles, SPACING),
    }
    on_circle = by_kind["circle"]
    graphs = {
        "complete": (on_circle, sensing_graph.complete(n_vehicles)),
        "star": (on_circle, sensing_graph.star(n_vehicles)),
        "ring": (on_circle, sensing_graph.ring(n_vehicles)),
        "nearest, count 2": (by_kind["v"], sensing_graph.nearest(by_kind["v"], 2)),
        "nearest, count 3": (by_kind["grid"], sensing_graph.nearest(by_kind["grid"], 3)),
    }
    figure = Figure(figsize=(11.0, 4.2), layout="constrained")
    for column, (kind, places) in enumerate(by_kind.items(), 1):
        if kind == "sphere":
            _draw_sphere(figure.add_subplot(2, _COLUMNS, column, projection="3d"), f"kind: {kind}", places)
        else:
            _draw_from_above(figure.add_subplot(2, _COLUMNS, column), f"kind: {kind}", places, frozenset())
    for column, (kind, (places, edges)) in enumerate(graphs.items(), 1 + _COLUMNS):
        _draw_from_above(figure.add_subplot(2, _COLUMNS, column), f"sensing: {kind}", places, edges)
    return figure


def _draw_from_above(axes: Any, title: str, places: Array, edges: Edges) -> None:
    """Forward is up, left is left."""
    points = np.stack([-places[:, 1], places[:, 0]], axis=1)
    for i, j in sorted(edges):
        axes.plot(*points[[i, j]].T, color=GUIDE, linewidth=0.9, zorder=1)
    axes.scatter(*points[1:].T, color=BLUE, s=26, zorder=2)
    axes.scatter(*points[:1].T, color=VERMILION, s=38, zorder=2)
    for number, point in enumerate(points[1:], 1):
        axes.annotate(str(number), point, xytext=(4, 3), textcoords="offset points", color=TEXT, fontsize=7)
    middle = 0.5 * (points.max(axis=0) + points.min(axis=0))
    half = 0.5 * max(float(np.ptp(points, axis=0).max()), SPACING) + 0.3 * SPACING
    axes.set_xlim(middle[0] - half, middle[0] + half)
    axes.set_ylim(middle[1] - half, middle[1] + half)
    axes.set_aspect("equal")
    axes.set_axis_off()
    axes.set_title(title)


def _draw_sphere(axes: Any, title: str, places: Array) -> None:
    """From behind, the right and above: the leader is on the far side."""
    centre, *_ = np.linalg.lstsq(2.0 * places[1:], (places[1:] ** 2).sum(axis=1), rcond=None)
    radius = float(np.linalg.norm(centre))
    azimuth, elevation = np.meshgrid(np.linspace(0.0, 2.0 * np.pi, 25), np.linspace(-0.5, 0.5, 13) * np.pi)
    x, y, z = np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)
    mesh = [c + radius * each for c, each in zip(centre, (x, y, z), strict=True)]
    axes.plot_wireframe(*mesh, color=SHADOW, linewidth=0.4)
    axes.scatter(*places[1:].T, color=BLUE, s=26, depthshade=False)
    axes.scatter(*places[:1].T, color=VERMILION, s=38, depthshade=False)
    for number, place in enumerate(places[1:], 1):
        axes.text(*(centre + 1.12 * (place - centre)), str(number), color=TEXT, fontsize=7)
    for axis, middle in zip("xyz", centre, strict=True):
        getattr(axes, f"set_{axis}lim")(middle - radius, middle + radius)
    axes.set_box_aspect((1.0, 1.0, 1.0), zoom=1.2)
    axes.view_init(elev=25.0, azim=-140.0)
    axes.set_axis_off()
    axes.set_title(title)
