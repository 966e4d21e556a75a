"""The flights of a comparison, and short names for them."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from relform_analysis.flight.log import FlightLog
from relform_analysis.flight.summary import Json


@dataclass(frozen=True, eq=False)
class ComparedFlight:
    """One flight of a comparison."""

    label: str
    """Short, and different from that of every other flight."""
    source: str
    """What the user named."""
    log: FlightLog
    summary: Json
    """Of the same flight, as ``build_summary`` makes it."""


def short_labels(sources: Sequence[str]) -> list[str]:
    """The last part of each path that tells it from the others, with as much of the path as this takes.

    ``runs/first/bag`` and ``runs/second/bag`` are first and second.
    """
    parts = [Path(source).parts for source in sources]
    while all(len(path) > 1 for path in parts) and len({path[-1] for path in parts}) == 1:
        parts = [path[:-1] for path in parts]
    longest = max(map(len, parts))
    for length in range(1, longest + 1):
        labels = ["/".join(path[-length:]) for path in parts]
        if len(set(labels)) == len(labels):
            return labels
    return [f"{label} ({number})" for number, label in enumerate(labels, 1)]
