"""A flight log as a small file: the arrays in single precision, compressed."""

import zipfile
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from relform_analysis.flight.log import FlightLog, LogEntry
from relform_core.atomic_file import write_atomically, written_atomically
from relform_core.errors import RelformError
from relform_core.load import LoadedScenario, load_scenario
from relform_core.run_folder import CONFIG_FILE

KEPT_FLIGHT = "flight.npz"
"""The log of a flight without a bag, beside its configuration."""
_TABLES = ("solver", "estimator", "active_constraints")
"""Fields of a log that hold arrays by name; an archive has each of these arrays under ``field.name``."""
_ENTRIES = ("faults", "changes", "degraded", "alarms")
"""Fields of a log that hold entries in words."""
_OTHERS = {"scenario", "phase", "real_time", *_TABLES, *_ENTRIES}
"""Fields of a log that are not arrays; no flight of a sweep is in real time."""


def write_log(path: Path | str, log: FlightLog) -> None:
    """Write a log atomically.

    Raises:
        RelformError: it cannot be written.
    """
    arrays: dict[str, Any] = {
        field.name: _compact(getattr(log, field.name)) for field in fields(log) if field.name not in _OTHERS
    }
    for table in _TABLES:
        arrays |= {f"{table}.{name}": _compact(values) for name, values in getattr(log, table).items()}
    arrays["phase"] = np.array(log.phase, dtype=np.str_)
    for name in _ENTRIES:
        entries = [(str(entry.stamp_ns), entry.source, entry.description) for entry in getattr(log, name)]
        arrays[name] = np.array(entries, dtype=np.str_)
    try:
        with written_atomically(path) as stream:
            np.savez_compressed(stream, **arrays)
    except OSError as error:
        raise RelformError(f"{path}: cannot be written: {error.strerror}") from None


def read_log(path: Path | str, scenario: LoadedScenario) -> FlightLog:
    """Read a log of this scenario.

    Raises:
        RelformError: it cannot be read.
    """
    try:
        with Path(path).open("rb") as stream, np.load(stream, allow_pickle=False) as archive:
            arrays = {name: _precise(archive[name]) for name in archive.files}
        phase = arrays.pop("phase")
        arrays.setdefault("alarms", np.zeros((0, 3)))  # an older version had none
        entries = {
            name: tuple(
                LogEntry(int(stamp), source, text) for stamp, source, text in arrays.pop(name).tolist()
            )
            for name in _ENTRIES
        }
        tables: dict[str, dict[str, Any]] = {table: {} for table in _TABLES}
        for name in [name for name in arrays if "." in name]:
            table, _, column = name.partition(".")
            tables[table][column] = arrays.pop(name)
        return FlightLog(
            scenario=scenario,
            phase=tuple(phase.tolist()),
            solver=tables["solver"],
            estimator=tables["estimator"],
            active_constraints=tables["active_constraints"],
            faults=entries["faults"],
            changes=entries["changes"],
            degraded=entries["degraded"],
            alarms=entries["alarms"],
            **arrays,
        )
    except (OSError, EOFError, ValueError, KeyError, TypeError, zipfile.BadZipFile) as error:
        problem = f"cannot be read as a flight: {error}; delete it to fly again"
        raise RelformError(f"{path}: {problem}") from None


def write_kept_flight(folder: Path, log: FlightLog) -> None:
    """Write a flight that has no bag of its own: its log and its configuration.

    Raises:
        RelformError: it cannot be written.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise RelformError(f"{folder}: cannot be made: {error.strerror}") from None
    write_atomically(folder / CONFIG_FILE, log.scenario.effective_yaml)
    write_log(folder / KEPT_FLIGHT, log)


def is_kept_flight(folder: Path) -> bool:
    """Whether a folder is one of ``write_kept_flight``."""
    return (folder / KEPT_FLIGHT).is_file()


def read_kept_flight(folder: Path) -> FlightLog:
    """Read a flight of ``write_kept_flight``.

    Raises:
        RelformError: it cannot be read.
    """
    return read_log(folder / KEPT_FLIGHT, load_scenario(folder / CONFIG_FILE))


def _compact(values: Any) -> Any:
    return values.astype(np.float32) if values.dtype == np.float64 else values


def _precise(values: Any) -> Any:
    return values.astype(np.float64) if values.dtype == np.float32 else values
