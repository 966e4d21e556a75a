"""The results of a campaign: one file per case, which the next session of the same software keeps."""

import json
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rich.table import Table

from relform_bringup.faults.plan import Case
from relform_core.atomic_file import write_json_atomically

CASES = "cases"
"""Folder with a file per case."""
CAMPAIGN_FILE = "faults.json"


@dataclass(frozen=True)
class Result:
    """Of one case."""

    kind: str
    seed: int
    problems: tuple[str, ...]
    """What did not hold; empty: the case has passed."""
    wall: float = 0.0
    """From the start of the first process to the end of the last [s]."""
    takeover: tuple[float, float] | None = None
    """How soon a controller that was started again commanded the team, from its admission and from its start
    [s]; None: there was none."""

    @property
    def case(self) -> Case:
        """The case."""
        return Case(self.kind, self.seed)


def store(folder: Path, result: Result, commit: str | None) -> None:
    """Keep the result of a case that was flown by a commit of the sources.

    Raises:
        RelformError: it cannot be written.
    """
    (folder / CASES).mkdir(parents=True, exist_ok=True)
    write_json_atomically(_file(folder, result.case), {"commit": commit, **asdict(result)})


def passed_before(folder: Path, case: Case, commit: str | None) -> Result | None:
    """The result of a case that has passed with the same sources; None: it must be flown."""
    if commit is None or commit.endswith("-dirty"):
        return None
    try:
        stored: dict[str, Any] = json.loads(_file(folder, case).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    if stored.pop("commit", None) != commit or stored.get("problems"):
        return None
    return Result(**{**stored, "problems": (), "takeover": stored["takeover"] and tuple(stored["takeover"])})


def by_kind(results: Iterable[Result]) -> dict[str, list[Result]]:
    """The results of each kind, in the order in which the kinds first occur."""
    found: dict[str, list[Result]] = {}
    for result in results:
        found.setdefault(result.kind, []).append(result)
    return found


def summary(results: Sequence[Result], wall: float, versions: dict[str, str | None]) -> dict[str, Any]:
    """The content of CAMPAIGN_FILE."""
    return {
        "cases": len(results),
        "passed": sum(not result.problems for result in results),
        "wall_s": wall,
        "kinds": {
            kind: {
                "cases": len(each),
                "passed": sum(not result.problems for result in each),
                "from_admission_s": _percentiles(each, 0),
                "from_start_s": _percentiles(each, 1),
            }
            for kind, each in by_kind(results).items()
        },
        "failed": [
            {"case": str(result.case), "problems": list(result.problems)}
            for result in results
            if result.problems
        ],
        "versions": versions,
    }


def table(results: Sequence[Result]) -> Table:
    """The results by kind."""
    rows = Table("kind", "cases", "passed", "takeover (s)", "from start (s)")
    for kind, each in by_kind(results).items():
        shown = [" ".join(f"{value:.2f}" for value in _percentiles(each, since) or ()) for since in (0, 1)]
        rows.add_row(kind, str(len(each)), str(sum(not result.problems for result in each)), *shown)
    rows.add_row("all", str(len(results)), str(sum(not result.problems for result in results)), "", "")
    rows.caption = (
        "takeover: from the admission to the first commands, and from the start; median, 95 %, most"
    )
    return rows


def _percentiles(results: Sequence[Result], since: int) -> list[float] | None:
    """Median, 95th percentile and maximum of one of the times to take over [s]; None: there are none."""
    times = [result.takeover[since] for result in results if result.takeover is not None]
    return [float(each) for each in np.percentile(times, [50.0, 95.0, 100.0])] if times else None


def _file(folder: Path, case: Case) -> Path:
    return folder / CASES / f"{case.kind}-{case.seed}.json"
