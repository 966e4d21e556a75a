"""Make the folder of a run, and let the link ``latest`` point to the newest."""

import os
import shutil
from contextlib import suppress
from datetime import datetime
from errno import EEXIST
from pathlib import Path

from relform_core.atomic_file import link_atomically
from relform_core.errors import FlightError
from relform_core.load import LoadedScenario
from relform_core.run_folder import LATEST, RUNS, RunFolder


def create_run_folder(scenario: LoadedScenario, out: Path | None, now: datetime) -> RunFolder:
    """Make the folder of a run and put the effective configuration into it.

    Args:
        out: the folder, must not exist; None: a new one in ``runs/``, to which ``latest`` then points.
        now: time for the name of a new folder.
    Raises:
        FlightError: the folder exists already, or cannot be written; then it is removed again.
    """
    name = f"{now:%Y%m%d-%H%M%S}-{scenario.config.name}-s{scenario.seed}"
    try:
        if out is None:
            path = _make_new_folder(name)
        else:
            path = out
            path.mkdir(parents=True)
    except FileExistsError as error:
        raise FlightError(f"{error.filename} exists already; choose another folder") from None
    except OSError as error:
        raise FlightError(f"{error.filename}: cannot be written: {error.strerror}") from None
    folder = RunFolder(path.absolute())
    try:
        folder.log.mkdir()
        folder.config.write_text(scenario.effective_yaml, encoding="utf-8")
        if out is None:
            link_atomically(RUNS / LATEST, path.name)
    except OSError as error:
        shutil.rmtree(path, ignore_errors=True)
        raise FlightError(f"{path}: cannot be written: {error.strerror}") from None
    return folder


def _make_new_folder(name: str) -> Path:
    """A folder in ``runs/``, with a number if another flight began in the same second."""
    RUNS.mkdir(exist_ok=True)
    for path in (RUNS / name, *(RUNS / f"{name}-{number}" for number in range(2, 100))):
        with suppress(FileExistsError):
            path.mkdir()
            return path
    raise FileExistsError(EEXIST, os.strerror(EEXIST), RUNS / name)
