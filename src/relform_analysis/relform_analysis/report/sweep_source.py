"""The results of a sweep, from its folder."""

import csv
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from relform_analysis.flight.summary import Json
from relform_analysis.report.json_file import read_json
from relform_analysis.sweep.folder import SWEEP_FILE, TABLE
from relform_core.errors import RelformError

TEXTS = ("variant", "scenario", "title", "outcome", "reason", "set")
"""Columns that stay text even if they look like a number."""
VARIANT_KEYS = {"name", "title", "set", "runs", "completed", "crashed", "failed", "reasons", "metrics"}


@dataclass(frozen=True)
class Sweep:
    """Results of a sweep."""

    report: Json
    """Content of sweep.json."""
    rows: list[dict[str, Any]]
    """One per run: numbers, texts, and None where there is no value."""


def is_sweep(path: Path) -> bool:
    """Whether a path names a sweep: its folder or its sweep.json."""
    return path.name == SWEEP_FILE or (path / SWEEP_FILE).is_file()


def read_sweep(path: Path | str) -> Sweep:
    """Read a concluded sweep.

    Args:
        path: its folder, or the sweep.json in it.
    Raises:
        RelformError: one line: what is missing or cannot be used.
    """
    path = Path(path)
    folder = path.parent if path.name == SWEEP_FILE else path
    report = read_json(folder / SWEEP_FILE)
    table = folder / TABLE
    try:
        with table.open(newline="", encoding="utf-8") as stream:
            rows = [
                {key: (text or None) if key in TEXTS else _value(text) for key, text in row.items()}
                for row in csv.DictReader(stream)
            ]
    except OSError as error:
        raise RelformError(f"{table}: cannot be read: {error.strerror}") from None
    except (UnicodeDecodeError, csv.Error) as error:
        raise RelformError(f"{table}: cannot be read: {error}") from None
    variants = report.get("variants")
    if (
        not isinstance(report.get("scenario"), str)
        or not isinstance(variants, list)
        or not all(isinstance(variant, dict) and variant.keys() >= VARIANT_KEYS for variant in variants)
    ):
        keys = ", ".join(sorted(VARIANT_KEYS))
        raise RelformError(f"{folder / SWEEP_FILE}: not of a sweep: needs scenario, and variants with {keys}")
    if not rows or not {"variant", "seed", "outcome"} <= rows[0].keys():
        raise RelformError(f"{table}: holds no runs; fly some with the command sweep")
    flown = Counter(row["variant"] for row in rows)
    for variant in variants:
        if flown[variant["name"]] != variant["runs"]:
            raise RelformError(
                f"{table}: has {flown[variant['name']]} runs of '{variant['name']}', {SWEEP_FILE} has "
                f"{variant['runs']}; run the command of the sweep again, it writes both"
            )
    return Sweep(report, rows)


def _value(text: str | None) -> Any:
    """A cell of the table, which CSV made text."""
    if not text:
        return None
    try:
        return float(text)
    except ValueError:
        return text
