"""The key figures at the top of a report."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from relform_analysis.flight.paper_claims import COMPARED

LABELS = {
    "steady_mean_m": "Formation error, steady",
    "peak_m": "Largest formation error",
    "leader_steady_mean_m": "Leader error, steady",
    "separation_min_m": "Smallest separation",
    "rotor_std_rpm": "Rotor speed spread",
    "step_ms_median": "Solver, per step",
}


@dataclass(frozen=True)
class Tile:
    """One key figure of a flight, or of a variant of a sweep."""

    label: str
    value: str
    note: str
    holds: bool | None
    """Whether it keeps a bound that the paper states; None: it states none."""


def headline_tiles(
    values: Callable[[str], float | None], notes: dict[str, str], keys: Sequence[str] = tuple(LABELS)
) -> list[Tile]:
    """The tiles of a flight, or of the means over many.

    Args:
        values: gives a number by its key in summary.json.
        notes: what stands below a number, by the same key.
        keys: the numbers to show, of ``LABELS``.
    """
    compared = {row.key: row for row in COMPARED}
    tiles = []
    for key in keys:
        number, value = compared[key], values(key)
        tiles.append(Tile(LABELS[key], number.text(value), notes.get(key, ""), number.holds(value)))
    return tiles
