"""What the page of a sweep draws: the flights of each variant by number, and the axes of its grid."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from relform_analysis.flight.paper_claims import COMPARED, ComparedNumber
from relform_analysis.flight.summary import Json, Outcome
from relform_analysis.report.sweep_source import Sweep
from relform_analysis.sweep.grid import short_keys, value_text

QUARTILES = (25.0, 50.0, 75.0)
DIGITS_OF_OTHERS = 3
BY_PHASE = "phases."
"""Prefix of the hundreds of numbers of single phases, which only sweep.json has."""
SIGNIFICANT_DIGITS = 5
"""Of the values on a page."""


def known_numbers(variants: Sequence[Json]) -> tuple[list[ComparedNumber], list[ComparedNumber]]:
    """The numbers that a variant has: those that the paper's are beside, and all others by their key."""
    compared = [number for number in COMPARED if _is_known(number.key, variants)]
    shown = {number.key for number in compared}
    others = [
        ComparedNumber(key, key, "", digits=DIGITS_OF_OTHERS)
        for key in dict.fromkeys(key for variant in variants for key in variant["metrics"])
        if key not in shown and not key.startswith(BY_PHASE) and _is_known(key, variants)
    ]
    return compared, others


def sweep_data(sweep: Sweep, numbers: Sequence[ComparedNumber], axes: Json, with_paper: bool) -> Json:
    """The data of the page, in the units of the tables.

    Args:
        sweep: its results.
        numbers: what is drawn.
        axes: as of ``grid_axes``.
        with_paper: whether the numbers of the paper are drawn beside.
    """
    variants = sweep.report["variants"]
    completed = {
        variant["name"]: [
            row
            for row in sweep.rows
            if row["variant"] == variant["name"] and row["outcome"] == Outcome.COMPLETED
        ]
        for variant in variants
    }
    return {
        "variants": [
            {key: variant[key] for key in ("name", "title", "runs", "completed")} for variant in variants
        ],
        "numbers": {
            number.key: {
                "label": number.label,
                "claim": number.claim if with_paper else None,
                "unit": number.unit,
                "digits": number.digits,
                "variants": [
                    _distribution(
                        number, completed[variant["name"]], variant["metrics"].get(number.key), with_paper
                    )
                    for variant in variants
                ],
            }
            for number in numbers
        },
        **axes,
    }


def grid_axes(variants: Sequence[Json]) -> Json:
    """The parameters of a sweep over a grid, and the place of each variant among their values.

    Values that are numbers are in increasing order, others as in the sweep.

    Returns:
        ``parameters``, none without a grid, and ``places``, for each variant an index per parameter.
    """
    grids = [variant.get("parameters") or {} for variant in variants]
    keys = list(grids[0])
    if any(list(grid) != keys for grid in grids):
        keys = []
    words = short_keys(keys)
    parameters, indices = [], []
    for key in keys:
        values = _distinct([grid[key] for grid in grids])
        numeric = all(isinstance(value, int | float) and not isinstance(value, bool) for value in values)
        ordered = sorted(values) if numeric else values
        parameters.append(
            {
                "key": key,
                "word": words[key],
                "texts": [value_text(value) for value in ordered],
                "numbers": ordered if numeric else None,
            }
        )
        indices.append([ordered.index(grid[key]) for grid in grids])
    return {"parameters": parameters, "places": [list(place) for place in zip(*indices, strict=True)]}


def is_constant(number: ComparedNumber, variants: Sequence[Json]) -> bool:
    """Whether a number is the same in all completed flights, at least two."""
    known = [metric for variant in variants if (metric := variant["metrics"].get(number.key)) and metric["n"]]
    values = {value for metric in known for value in (metric["min"], metric["max"])}
    return len(values) == 1 and sum(metric["n"] for metric in known) > 1


def _distinct(values: Sequence[Any]) -> list[Any]:
    return [value for index, value in enumerate(values) if value not in values[:index]]


def _distribution(
    number: ComparedNumber,
    rows: Sequence[Mapping[str, Any]],
    statistics: Mapping[str, Any] | None,
    with_paper: bool,
) -> Json | None:
    values = [
        (int(row["seed"]), number.factor * row[number.key])
        for row in rows
        if isinstance(row.get(number.key), float)
    ]
    if not values or not statistics or statistics["mean"] is None:
        return None
    quartiles = np.percentile([value for _, value in values], QUARTILES)
    return {
        "seeds": [seed for seed, _ in values],
        "values": [_short(value) for _, value in values],
        "quartiles": [_short(float(value)) for value in quartiles],
        **{name: _short(number.factor * statistics[name]) for name in ("mean", "min", "p95", "max")},
        "ci95": [_short(number.factor * bound) for bound in statistics["ci95"]]
        if statistics["ci95"]
        else None,
        "holds": number.holds(statistics["mean"]) if with_paper else None,
    }


def _short(value: float) -> float:
    return float(f"{value:.{SIGNIFICANT_DIGITS}g}")


def _is_known(key: str, variants: Sequence[Json]) -> bool:
    return any((variant["metrics"].get(key) or {}).get("n") for variant in variants)
