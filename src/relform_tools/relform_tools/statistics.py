"""Honest statistics over many flights: every run is counted, and what a mean leaves out is said beside it."""

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from relform_tools.summary import Json, Outcome

CONFIDENCE = 0.95


def flatten(summary: Json) -> dict[str, Any]:
    """The row of one run in a table: every number, text and truth value at the top level of its summary."""
    return {
        key: value for key, value in summary.items() if value is None or isinstance(value, str | int | float)
    }


def aggregate(rows: Sequence[Mapping[str, Any]]) -> Json:
    """Statistics of the runs of one variant.

    Errors are averaged over the completed runs, because a flight that ended early has none in its later
    phases; how many these are, how many crashed or failed, and why, stands beside them.
    """
    completed = [row for row in rows if row["outcome"] == Outcome.COMPLETED]
    outcomes = Counter(row["outcome"] for row in rows)
    numbers = [
        key
        for key in (rows[0] if rows else {})
        if key != "seed" and any(_is_number(row[key]) for row in rows)
    ]
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
            key: describe([row[key] for row in completed if _is_number(row[key])]) for key in numbers
        },
    }


def describe(values: Sequence[float]) -> Json:
    """Distribution of values, with the 95 % confidence interval of their mean (Student's t)."""
    n = len(values)
    if n == 0:
        return {"n": 0, "mean": None, "std": None, "p95": None, "max": None, "ci95": None}
    mean, deviation = float(np.mean(values)), float(np.std(values, ddof=1)) if n > 1 else 0.0
    interval = None
    if n > 1:
        from scipy.special import stdtrit  # SciPy takes its time, which only who has values should wait for

        half = float(stdtrit(n - 1, 0.5 + CONFIDENCE / 2.0)) * deviation / math.sqrt(n)
        interval = [mean - half, mean + half]
    return {
        "n": n,
        "mean": mean,
        "std": deviation,
        "p95": float(np.percentile(values, 95.0)),
        "max": float(np.max(values)),
        "ci95": interval,
    }


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)
