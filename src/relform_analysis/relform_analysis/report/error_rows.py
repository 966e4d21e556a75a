"""The errors in summary.json as rows of a table: by phase, of the whole flight, of its steady windows."""

from collections.abc import Sequence
from dataclasses import dataclass

from relform_analysis.flight.summary import Json, Outcome

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
    return [
        *(phase["name"] for phase in summary["phases"]),
        "all",
        *(["steady"] if _is_steady(summary) else []),
    ]


def error_rows(summary: Json) -> list[ErrorRows]:
    """Every pair, the leader's position and yaw, and the followers' yaw."""
    phases, steady = summary["phases"], _is_steady(summary)
    pairs = [
        _rows(
            (f"{pair['observer']} ->", pair["target"]),
            [p["pairs"][index] for p in phases],
            pair,
            "",
            "m",
            steady,
        )
        for index, pair in enumerate(summary["pairs"])
    ]
    return [
        *pairs,
        _rows(("leader", "position"), phases, summary, "leader_", "m", steady),
        _rows(("leader", "yaw"), phases, summary, "leader_yaw_", "deg", steady),
        _rows(("followers", "yaw"), phases, summary, "follower_yaw_", "deg", steady),
    ]


def _rows(
    words: tuple[str, str], phases: Sequence[Json], flight: Json, prefix: str, unit: str, steady: bool
) -> ErrorRows:
    cells = []
    for statistic in STATISTICS:
        values = [phase[f"{prefix}{statistic}_{unit}"] for phase in phases]
        values.append(flight[f"{prefix}{statistic}_{unit}"])
        if steady:
            values.append(flight[f"{prefix}steady_{statistic}_{unit}"])
        cells.append(tuple(NONE if value is None else f"{value:.{DIGITS[unit]}f}" for value in values))
    return ErrorRows(words, unit, tuple(cells))


def _is_steady(summary: Json) -> bool:
    """Whether numbers of steady state mean anything: those of a flight that ended early do not."""
    return bool(summary["outcome"] == Outcome.COMPLETED)
