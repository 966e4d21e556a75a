"""The errors in summary.json as rows of a table: by phase, of the whole flight, of its steady windows."""

from collections.abc import Sequence
from dataclasses import dataclass

from relform_analysis.flight.summary import Json

STATISTICS = ("mean", "p95", "max")
"""As the keys of summary.json name them."""
NONE = "-"
DIGITS = {"m": 3, "deg": 1}


@dataclass(frozen=True)
class ErrorRows:
    """One error, with a row for each of ``STATISTICS``."""

    words: tuple[str, str]
    """What it is the error of: ``leader ->``, ``follower_1``."""
    unit: str
    cells: tuple[tuple[str, ...], ...]
    """By statistic; each phase, then all and steady."""


def error_columns(summary: Json) -> list[str]:
    """Headings of the cells."""
    return [*(phase["name"] for phase in summary["phases"]), "all", "steady"]


def error_rows(summary: Json) -> list[ErrorRows]:
    """Every pair, the leader's position and yaw, and the followers' yaw."""
    phases = summary["phases"]
    pairs = [
        _rows((f"{pair['observer']} ->", pair["target"]), [p["pairs"][index] for p in phases], pair, "", "m")
        for index, pair in enumerate(summary["pairs"])
    ]
    return [
        *pairs,
        _rows(("leader", "position"), phases, summary, "leader_", "m"),
        _rows(("leader", "yaw"), phases, summary, "leader_yaw_", "deg"),
        _rows(("followers", "yaw"), phases, summary, "follower_yaw_", "deg"),
    ]


def _rows(words: tuple[str, str], phases: Sequence[Json], flight: Json, prefix: str, unit: str) -> ErrorRows:
    cells = []
    for statistic in STATISTICS:
        values = [phase[f"{prefix}{statistic}_{unit}"] for phase in phases]
        values += [flight[f"{prefix}{statistic}_{unit}"], flight[f"{prefix}steady_{statistic}_{unit}"]]
        cells.append(tuple(NONE if value is None else f"{value:.{DIGITS[unit]}f}" for value in values))
    return ErrorRows(words, unit, tuple(cells))
