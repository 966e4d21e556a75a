"""The folder of a sweep: a file per finished run, written atomically, and their table and statistics."""

import csv
import fcntl
import io
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Self

from relform_analysis.flight.archive import read_log, write_log
from relform_analysis.flight.log import FlightLog
from relform_analysis.flight.summary import Json
from relform_analysis.sweep.plan import Run
from relform_analysis.sweep.statistics import aggregate
from relform_analysis.sweep.variant import Variant
from relform_core.atomic_file import write_atomically, write_json_atomically
from relform_core.errors import RelformError
from relform_core.schema import Schema

TABLE = "runs.csv"
SWEEP_FILE = "sweep.json"
RUNS = "runs"
"""Folder with a file per finished run."""
FORMAT_VERSION = 1
SHOWN = 3
"""Flights that an error names."""


class _StoredRun(Schema):
    fingerprint: str
    configuration: str
    """Of the scenario, seed included, whatever the software."""
    row: dict[str, str | int | float | None]


class SweepFolder:
    """Results of a sweep on disk. As a context manager it locks the folder for this process.

    Raises:
        RelformError: the folder cannot be made, or another sweep is running in it.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._lock = -1

    def __enter__(self) -> Self:
        try:
            (self.path / RUNS).mkdir(parents=True, exist_ok=True)
            # The system releases the lock when this process ends, even if it is killed.
            self._lock = os.open(self.path / RUNS, os.O_RDONLY)
            fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            os.close(self._lock)
            raise RelformError(f"{self.path}: another sweep is running in this folder") from None
        except OSError as error:
            raise RelformError(f"{self.path}: cannot be made: {error.strerror}") from None
        return self

    def __exit__(self, *exception: object) -> None:
        os.close(self._lock)

    def refuse_other_sweep(self, runs: Sequence[Run]) -> None:
        """Make sure that these runs replace no flight of another sweep.

        Raises:
            RelformError: the folder holds flights that are not among the runs, or of another configuration.
        """
        planned = {run.name: run.scenario.fingerprint for run in runs}
        others = [
            file.stem
            for file in sorted((self.path / RUNS).glob("*.json"))
            if (stored := _read_stored(file)) is not None and stored.configuration != planned.get(file.stem)
        ]
        if others:
            named = ", ".join(others[:SHOWN]) + (", ..." if len(others) > SHOWN else "")
            raise RelformError(
                f"{self.path}: holds {len(others)} flight(s) of another sweep, with other variants, seeds or "
                f"settings ({named}); name another folder with --out, or delete this one"
            )

    def finished(self, run: Run) -> Json | None:
        """Row of a run that has been flown with the same configuration and software."""
        stored = _read_stored(self._row_file(run))
        if stored is None:
            return None
        if stored.fingerprint != run.fingerprint or (run.keeps_log and not self._log_file(run).is_file()):
            return None
        return stored.row

    def store(self, run: Run, row: Mapping[str, Any], log: FlightLog | None = None) -> None:
        """Keep the outcome of a run.

        Raises:
            RelformError: it cannot be written.
        """
        if log is not None:
            write_log(self._log_file(run), log)
        stored = _StoredRun(
            fingerprint=run.fingerprint, configuration=run.scenario.fingerprint, row=dict(row)
        )
        write_atomically(self._row_file(run), stored.model_dump_json(indent=1))

    def log(self, run: Run) -> FlightLog:
        """The flight of a finished run that keeps its log.

        Raises:
            RelformError: it cannot be read.
        """
        return read_log(self._log_file(run), run.scenario)

    def conclude(
        self,
        scenario: str,
        overrides: Sequence[str],
        variants: Sequence[Variant],
        rows: Sequence[Mapping[str, Any]],
        versions: Mapping[str, str | None],
    ) -> Json:
        """Write the table and sweep.json (docs/sweep.md) from the rows of all runs, and return the latter.

        Args:
            scenario: its file.
            overrides: keys that were changed in all variants, ``some.key=value``.
            variants: with their own changes.
            rows: of all runs.
            versions: of the software.
        Raises:
            RelformError: they cannot be written.
        """
        report = {
            "format": FORMAT_VERSION,
            "scenario": scenario,
            "set": list(overrides),
            "variants": [
                {
                    "name": variant.name,
                    "title": variant.title,
                    "scenario": variant.scenario,
                    "set": list(variant.set),
                    "parameters": dict(variant.parameters),
                    **aggregate([row for row in rows if row["variant"] == variant.name]),
                }
                for variant in variants
            ],
            "versions": dict(versions),
        }
        write_table(self.path / TABLE, rows)
        write_json_atomically(self.path / SWEEP_FILE, report)
        return report

    def _row_file(self, run: Run) -> Path:
        return self.path / RUNS / f"{run.name}.json"

    def _log_file(self, run: Run) -> Path:
        return self.path / RUNS / f"{run.name}.npz"


def _read_stored(file: Path) -> _StoredRun | None:
    """A stored run; None if there is none, or it is damaged and will be flown again."""
    try:
        return _StoredRun.model_validate_json(file.read_bytes())
    except (OSError, ValueError):
        return None


def write_table(path: Path, rows: Sequence[Mapping[str, Any]]) -> None:
    """Write rows as CSV atomically, with a column for every key that one of them has.

    Raises:
        RelformError: it cannot be written.
    """
    fields = list(dict.fromkeys(key for row in rows for key in row))
    table = io.StringIO()
    writer = csv.DictWriter(table, fields)
    writer.writeheader()
    writer.writerows(rows)
    write_atomically(path, table.getvalue())
