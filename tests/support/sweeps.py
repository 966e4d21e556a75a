"""Sweeps for tests: short flights, and rows without times."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from relform_analysis.sweep.plan import Run, plan_runs
from relform_analysis.sweep.variant import Variant
from support.scenarios import PAPER

BASE = Variant(name="base", title="as it is", set=())
LOOSE = Variant(name="loose", title="weak formation", set=("controller.weights.formation_per_m2=1.0",))


def short_phases(seconds: float) -> str:
    """Override: the flight is a straight line of this many seconds."""
    motion = "{kind: straight, speed_m_s: 1.0, ramp_s: 0.2}"
    return (
        f"phases=[{{name: B, title: short, duration_s: {seconds}, steady_from_s: 0.1, formation: initial, "
        f"motion: {motion}}}]"
    )


def short_runs(n_seeds: int, *overrides: str, variants: Sequence[Variant] = (BASE,)) -> list[Run]:
    """Flights of a quarter of a second."""
    return plan_runs(PAPER, variants, (short_phases(0.25), *overrides), range(1, 1 + n_seeds))


def without_times(row: Mapping[str, Any]) -> dict[str, Any]:
    """A row without the numbers that depend on the machine and its load."""
    return {
        key: value
        for key, value in row.items()
        if key not in ("wall_s", "realtime_factor") and "_ms_" not in key
    }


def files_of(folder: Path) -> dict[str, int]:
    """The results in the folder of a sweep, with their times of modification."""
    return {file.name: file.stat().st_mtime_ns for file in sorted((folder / "runs").glob("*.json"))}
