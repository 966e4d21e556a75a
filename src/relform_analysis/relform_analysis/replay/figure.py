"""The picture of a counterfactual replay: where other commands were decided, and by how much."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from relform_analysis.plots.style import GREEN, GUIDE, SHADOW, TEXT, VERMILION
from relform_analysis.replay.replay import Replay
from relform_core.errors import RelformError
from relform_core.units import rad_s_to_rpm
from relform_core.vehicle_config import VehicleConfig

if TYPE_CHECKING:  # matplotlib takes a second to import
    from matplotlib.figure import Figure

WIDTH_IN, VEHICLE_IN, DPI = 12.0, 2.6, 120
DIFFERENCE = "replayed minus recorded, range of the rotors (rpm)"


def draw_replay(result: Replay, vehicle: VehicleConfig, path: Path) -> None:
    """Write the picture; its format is that of the file's name.

    Raises:
        RelformError: the file cannot be written.
    """
    try:
        replay_figure(result, vehicle).savefig(path, dpi=DPI)
    except (OSError, ValueError) as error:
        raise RelformError(f"{path}: cannot be written: {error}") from None


def replay_figure(result: Replay, vehicle: VehicleConfig) -> Figure:
    """Rotor speeds as recorded and replayed, averaged over the rotors, and the range of their differences."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    n = len(result.vehicles)
    figure = Figure(figsize=(WIDTH_IN, VEHICLE_IN * n), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(2 * n, 1, sharex=True, squeeze=False)[:, 0]
    rpm = rad_s_to_rpm(1.0)
    for index, name in enumerate(result.vehicles):
        speeds, difference = axes[2 * index], axes[2 * index + 1]
        for values, colour, width, label in (
            (result.recorded, TEXT, 1.5, "recorded"),
            (result.replayed, VERMILION, 0.9, "replayed"),
        ):
            speeds.plot(
                result.time, rpm * values[:, index].mean(axis=1), color=colour, linewidth=width, label=label
            )
        speeds.axhline(rpm * vehicle.hover_speed, color=SHADOW, linewidth=0.8, zorder=0)
        speeds.set_title(f"{name}: mean rotor speed (rpm)", loc="left", fontsize=10)
        change = rpm * result.difference[:, index]
        difference.fill_between(result.time, change.min(axis=1), change.max(axis=1), color=GREEN, step="post")
        difference.axhline(0.0, color=GUIDE, linewidth=0.8)
        difference.set_title(DIFFERENCE, loc="left", fontsize=10)
        for each in (speeds, difference):
            each.spines[["top", "right"]].set_visible(False)
    axes[0].legend(loc="upper right", ncols=2, frameon=False)
    axes[-1].set_xlabel("time (s)")
    return figure
