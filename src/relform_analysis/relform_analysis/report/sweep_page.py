"""The report of a sweep: the distribution of each number, by variant."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from relform_analysis.flight.paper_claims import COMPARED, FOOTNOTE, ComparedNumber
from relform_analysis.flight.summary import Json, Outcome
from relform_analysis.report.page import render
from relform_analysis.report.sweep_source import Sweep
from relform_analysis.report.tiles import Tile, headline_tiles
from relform_analysis.sweep.statistics import describe
from relform_core.atomic_file import write_atomically

SCRIPTS = ("base.js", "strips.js")
QUARTILES = (25.0, 50.0, 75.0)
DIGITS_OF_OTHERS = 3
BY_PHASE = "phases."
"""Prefix of the hundreds of numbers of single phases, which only sweep.json has."""


@dataclass(frozen=True)
class Row:
    """One number of one variant, as text."""

    variant: str
    n: int
    mean: str
    ci95: str
    min: str
    p95: str
    max: str
    holds: bool | None
    """Whether the mean keeps the paper's bound; None: the paper states none."""


@dataclass(frozen=True)
class Section:
    """One number of all variants."""

    number: ComparedNumber
    rows: tuple[Row, ...]


def write_sweep_report(path: Path, sweep: Sweep) -> None:
    """Write the report of a sweep.

    Raises:
        RelformError: it cannot be written.
    """
    write_atomically(path, sweep_page(sweep))


def sweep_page(sweep: Sweep) -> str:
    """The report of a sweep, HTML."""
    variants = sweep.report["variants"]
    compared = [number for number in COMPARED if _is_known(number.key, variants)]
    shown = {number.key for number in compared}
    others = [
        ComparedNumber(key, key, "", digits=DIGITS_OF_OTHERS)
        for key in dict.fromkeys(key for variant in variants for key in variant["metrics"])
        if key not in shown and not key.startswith(BY_PHASE) and _is_known(key, variants)
    ]
    return render(
        "sweep.html",
        SCRIPTS,
        sweep_data(sweep, [*compared, *others]),
        name=Path(sweep.report["scenario"]).stem,
        scenario=sweep.report["scenario"],
        overrides=sweep.report.get("set", []),
        tiles=_tiles(variants[0]) if len(variants) == 1 else [],
        variants=variants,
        flights=sum(variant["runs"] for variant in variants),
        completed=sum(variant["completed"] for variant in variants),
        crashed=sum(variant["crashed"] for variant in variants),
        failed=sum(variant["failed"] for variant in variants),
        sections=[_section(number, variants) for number in compared],
        others=[_section(number, variants) for number in others],
        footnote=FOOTNOTE,
        versions=sweep.report.get("versions") or {},
    )


def sweep_data(sweep: Sweep, numbers: Sequence[ComparedNumber]) -> Json:
    """What the page draws: values of completed flights by number and variant, in the units of the tables."""
    names = [variant["name"] for variant in sweep.report["variants"]]
    completed = {
        name: [row for row in sweep.rows if row["variant"] == name and row["outcome"] == Outcome.COMPLETED]
        for name in names
    }
    return {
        "variants": names,
        "numbers": {
            number.key: {
                "claim": number.claim,
                "unit": number.unit,
                "digits": number.digits,
                "variants": [
                    _distribution(number, completed[name], variant["metrics"].get(number.key))
                    for name, variant in zip(names, sweep.report["variants"], strict=True)
                ],
            }
            for number in numbers
        },
    }


def _distribution(
    number: ComparedNumber, rows: Sequence[Mapping[str, Any]], statistics: Mapping[str, Any] | None
) -> Json | None:
    values = [
        (int(row["seed"]), number.factor * row[number.key])
        for row in rows
        if isinstance(row.get(number.key), float)
    ]
    if not values or not statistics or statistics["mean"] is None:
        return None
    interval = statistics["ci95"]
    return {
        "seeds": [seed for seed, _ in values],
        "values": [value for _, value in values],
        "quartiles": np.percentile([value for _, value in values], QUARTILES).tolist(),
        "mean": number.factor * statistics["mean"],
        "ci95": [number.factor * bound for bound in interval] if interval else None,
    }


def _tiles(variant: Json) -> list[Tile]:
    metrics = variant["metrics"]
    rows = {number.key: _row(number, variant) for number in COMPARED}
    notes = {key: f"mean; {row.ci95}" if row.ci95 else "mean" for key, row in rows.items()}
    return headline_tiles(lambda key: (metrics.get(key) or {"mean": None})["mean"], notes)


def _section(number: ComparedNumber, variants: Sequence[Json]) -> Section:
    return Section(number, tuple(_row(number, variant) for variant in variants))


def _row(number: ComparedNumber, variant: Json) -> Row:
    statistics = variant["metrics"].get(number.key) or describe([])
    low, high = statistics["ci95"] or (None, None)
    return Row(
        variant["name"],
        statistics["n"],
        number.text(statistics["mean"]),
        "" if low is None else f"{number.bare(low)} … {number.bare(high)}",
        number.bare(statistics["min"]),
        number.bare(statistics["p95"]),
        number.bare(statistics["max"]),
        number.holds(statistics["mean"]),
    )


def _is_known(key: str, variants: Sequence[Json]) -> bool:
    return any((variant["metrics"].get(key) or {}).get("n") for variant in variants)
