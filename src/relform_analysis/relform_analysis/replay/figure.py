"""The picture of a counterfactual replay: where other commands were decided, and by how much."""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from relform_analysis.replay.replay import Replay
from relform_core.errors import RelformError
from relform_core.units import rad_s_to_rpm
from relform_core.vehicle_config import VehicleConfig

plt.switch_backend("Agg")


def draw_replay(result: Replay, vehicle: VehicleConfig, path: Path) -> None:
    """Rotor speeds as recorded and replayed, averaged over the rotors, and the range of their differences.

    Raises:
        RelformError: the file cannot be written.
    """
    n = len(result.vehicles)
    figure, axes = plt.subplots(
        2 * n, 1, figsize=(12, 2.6 * n), sharex=True, layout="constrained", squeeze=False
    )
    rpm = rad_s_to_rpm(1.0)
    for index, name in enumerate(result.vehicles):
        speeds, difference = axes[2 * index, 0], axes[2 * index + 1, 0]
        speeds.plot(result.time, rpm * result.recorded[:, index].mean(axis=1), color="0.2", label="recorded")
        speeds.plot(
            result.time,
            rpm * result.replayed[:, index].mean(axis=1),
            color="#D55E00",
            lw=0.9,
            label="replayed",
        )
        speeds.set_title(f"{name}: mean rotor speed (rpm)", loc="left", fontsize=10)
        speeds.axhline(rpm * vehicle.hover_speed, color="0.7", lw=0.8, zorder=0)
        change = rpm * result.difference[:, index]
        difference.fill_between(
            result.time, change.min(axis=1), change.max(axis=1), color="#56B4E9", step="post"
        )
        difference.plot(result.time, np.zeros_like(result.time), color="0.5", lw=0.8)
        difference.set_title("replayed minus recorded, range of the rotors (rpm)", loc="left", fontsize=10)
        for each in (speeds, difference):
            each.spines[["top", "right"]].set_visible(False)
    axes[0, 0].legend(loc="upper right", ncols=2, frameon=False)
    axes[-1, 0].set_xlabel("time (s)")
    try:
        figure.savefig(path, dpi=120)
    except (OSError, ValueError) as error:
        raise RelformError(f"{path}: cannot be written: {error}") from None
    finally:
        plt.close(figure)
