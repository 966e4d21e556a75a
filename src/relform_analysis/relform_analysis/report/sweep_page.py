"""The report of a sweep: plots over its grid, a table of its variants, and how each number is distributed."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from relform_analysis.flight.paper_claims import COMPARED, FOOTNOTE, ComparedNumber
from relform_analysis.flight.paper_scenario import PAPER, SECTIONS
from relform_analysis.flight.summary import Json
from relform_analysis.report.page import render
from relform_analysis.report.sweep_data import grid_axes, is_constant, known_numbers, sweep_data
from relform_analysis.report.sweep_source import Sweep
from relform_analysis.report.tiles import LABELS, Tile, headline_tiles
from relform_analysis.sweep.grid import value_text
from relform_core.atomic_file import write_atomically

SCRIPTS = (
    "base.js",
    "scale.js",
    "strips.js",
    "variants.js",
    "heat_map.js",
    "curves.js",
    "grid.js",
    "sweep.js",
)
FEW = 4
"""Up to so many variants the page shows all numbers below each other; of more, or a grid, one at a time."""


VALUES_MAX = 2500
"""Means on a page at most; of more, those that are not beside the paper's are in sweep.json only."""


@dataclass(frozen=True)
class Cell:
    """The mean of a number of one variant."""

    mean: float | None
    """As the table sorts it."""
    text: str
    holds: bool | None
    """Whether the mean keeps the paper's bound; None: the paper states none."""


def write_sweep_report(path: Path | str, sweep: Sweep) -> None:
    """Write the report of a sweep.

    Raises:
        RelformError: it cannot be written.
    """
    write_atomically(path, sweep_page(sweep))


def sweep_page(sweep: Sweep) -> str:
    """The report of a sweep, HTML."""
    variants = sweep.report["variants"]
    compared, others = known_numbers(variants)
    if len(variants) * len([*compared, *others]) > VALUES_MAX:
        others = []
    headline = [number for number in compared if number.key in LABELS]
    constant = [number for number in compared if is_constant(number, variants)]
    axes = grid_axes(variants)
    parameters = axes["parameters"]
    with_paper = _is_paper(sweep.report, [parameter["key"] for parameter in parameters])
    return render(
        "sweep.html",
        SCRIPTS,
        sweep_data(sweep, [*compared, *others], axes, with_paper),
        styles=("sweep.css",),
        title=_title(sweep),
        scenario=sweep.report["scenario"],
        overrides=sweep.report.get("set", []),
        tiles=_tiles(variants[0], with_paper) if len(variants) == 1 else [],
        variants=variants,
        only=variants[0] if len(variants) == 1 else None,
        parameters=parameters,
        values=[
            [value_text(value) for value in (variant.get("parameters") or {}).values()]
            for variant in variants
        ],
        **{
            count: sum(variant[count] for variant in variants)
            for count in ("runs", "completed", "crashed", "failed")
        },
        headline=headline,
        labels=LABELS,
        cells=[[_cell(number, variant, with_paper) for number in headline] for variant in variants],
        drawn=[number for number in headline if number not in constant],
        drawn_too=[number for number in compared if number not in constant and number not in headline],
        constant=[(number, _first_text(number, variants)) for number in constant],
        compared=[number for number in compared if number not in constant],
        others=others,
        few=len(variants) <= FEW and not parameters,
        with_paper=with_paper,
        footnote=FOOTNOTE,
        versions=sweep.report.get("versions") or {},
    )


def _title(sweep: Sweep) -> str:
    """The title of the flights, if it is the same for all; else the name of the scenario."""
    titles = {row["title"] for row in sweep.rows if row.get("title")}
    return titles.pop() if len(titles) == 1 else Path(sweep.report["scenario"]).stem


def _is_paper(report: Json, parameters: Sequence[str]) -> bool:
    """Whether all variants together are the paper's scenario, with any controller."""
    changed = (*report.get("set", []), *parameters)
    return Path(report["scenario"]).stem == PAPER and not any(key.startswith(SECTIONS) for key in changed)


def _tiles(variant: Json, with_paper: bool) -> list[Tile]:
    metrics = variant["metrics"]
    notes = {}
    for number in COMPARED:
        low, high = (metrics.get(number.key) or {}).get("ci95") or (None, None)
        notes[number.key] = "mean" if low is None else f"mean; {number.bare(low)} … {number.bare(high)}"
    tiles = headline_tiles(lambda key: (metrics.get(key) or {"mean": None})["mean"], notes)
    return tiles if with_paper else [replace(tile, holds=None) for tile in tiles]


def _cell(number: ComparedNumber, variant: Json, with_paper: bool) -> Cell:
    mean = (variant["metrics"].get(number.key) or {}).get("mean")
    return Cell(mean, number.bare(mean), number.holds(mean) if with_paper else None)


def _first_text(number: ComparedNumber, variants: Sequence[Json]) -> str:
    means: list[Any] = [(variant["metrics"].get(number.key) or {}).get("mean") for variant in variants]
    return number.text(next(mean for mean in means if mean is not None))
