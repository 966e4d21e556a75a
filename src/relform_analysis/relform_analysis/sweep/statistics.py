"""Statistics over many flights: means over completed runs, and counts of all others beside them."""

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from relform_analysis.flight.summary import Json, Outcome

CONFIDENCE = 0.95
LOG_FACTOR_MAX = 50.0
"""An interval this wide says nothing; a wider one would not be a finite number."""
NO_METRICS = ("format", "seed")
"""Numbers of a row that are not averaged."""
SIGNED = ("view_margin_min_deg",)
"""Numbers that may be negative, by the last part of their name; all others are lengths, times, counts."""


def flatten(summary: Json) -> dict[str, Any]:
    """The row of one run in a table: every number and text of its summary, by the path of its key.

    ``steady_mean_m``, ``phases.B.leader_max_m``, ``pairs.leader.follower_1.steady_mean_m``.
    """
    row = _scalars(summary, "") | _pairs(summary, "")
    for phase in summary["phases"]:
        prefix = f"phases.{phase['name']}."
        row |= _scalars(phase, prefix) | _pairs(phase, prefix)
    return row


def aggregate(rows: Sequence[Mapping[str, Any]]) -> Json:
    """Statistics of the runs of one variant.

    Numbers are averaged over the completed runs, because a flight that ended early has none in its later
    phases. The numbers of completed, crashed and failed runs are beside them, with the reasons.
    """
    completed = [row for row in rows if row["outcome"] == Outcome.COMPLETED]
    outcomes = Counter(row["outcome"] for row in rows)
    metrics = dict.fromkeys(
        key for row in rows for key, value in row.items() if key not in NO_METRICS and _is_number(value)
    )
    return {
        "runs": len(rows),
        "completed": len(completed),
        "crashed": outcomes[Outcome.FAULT],
        "failed": outcomes[Outcome.FAILED],
        "reasons": [
            {"seed": row["seed"], "outcome": row["outcome"], "reason": row["reason"]}
            for row in rows
            if row["outcome"] != Outcome.COMPLETED
        ],
        "metrics": {
            key: describe(
                [row[key] for row in completed if _is_number(row.get(key))],
                signed=key.rpartition(".")[2] in SIGNED,
            )
            for key in metrics
        },
    }


def describe(values: Sequence[float], signed: bool = True) -> Json:
    """Distribution of values, with the 95 % confidence interval of their mean.

    The deviation is that of a sample; one value has neither a deviation nor an interval.

    Args:
        values: one per flight.
        signed: whether such a number may be negative; if not, its interval is not either.
    """
    n = len(values)
    if n == 0:
        return {"n": 0, "mean": None, "std": None, "min": None, "p95": None, "max": None, "ci95": None}
    mean, deviation, interval = float(np.mean(values)), None, None
    if n > 1:
        deviation = float(np.std(values, ddof=1))
        interval = _interval(mean, deviation, n, positive=not signed and min(values) >= 0.0 and mean > 0.0)
    return {
        "n": n,
        "mean": mean,
        "std": deviation,
        "min": float(np.min(values)),
        "p95": float(np.percentile(values, 95.0)),
        "max": float(np.max(values)),
        "ci95": interval,
    }


def _interval(mean: float, deviation: float, n: int, positive: bool) -> list[float]:
    """The 95 % confidence interval of a mean: Student's t; of positive numbers on a logarithmic scale.

    The logarithm of the mean has the standard error of the mean over the mean, to first order.
    """
    from scipy.special import stdtrit  # imported here, because SciPy is slow to import

    half = float(stdtrit(n - 1, 0.5 + CONFIDENCE / 2.0)) * deviation / math.sqrt(n)
    if positive:
        factor = math.exp(min(half / mean, LOG_FACTOR_MAX))
        return [mean / factor, mean * factor]
    return [mean - half, mean + half]


def _scalars(part: Json, prefix: str) -> dict[str, Any]:
    return {
        f"{prefix}{key}": value
        for key, value in part.items()
        if value is None or isinstance(value, str | int | float)
    }


def _pairs(part: Json, prefix: str) -> dict[str, Any]:
    row: dict[str, Any] = {}
    for pair in part["pairs"]:
        numbers = {key: value for key, value in pair.items() if key not in ("observer", "target")}
        row |= _scalars(numbers, f"{prefix}pairs.{pair['observer']}.{pair['target']}.")
    return row


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)
