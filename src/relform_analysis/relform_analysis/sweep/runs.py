"""Many flights over seeds and variants of a scenario: flown in parallel, and resumable at any time.

Each finished run is stored as it ends, with a fingerprint of everything that it depends on: a stored run is
flown again only if it no longer fits.
"""

import sys
from collections.abc import Iterator, Sequence
from concurrent.futures import Executor, Future, as_completed
from typing import Any

from relform_analysis.flight.summary import Json, Outcome
from relform_analysis.sweep.flight_row import failed, fly, identity
from relform_analysis.sweep.folder import SweepFolder
from relform_analysis.sweep.plan import Run


def resume(runs: Sequence[Run], folder: SweepFolder) -> tuple[list[Json], list[Run]]:
    """Rows of the runs that have been flown, and the runs that have not.

    Raises:
        RelformError: the folder holds flights of another sweep.
    """
    folder.refuse_other_sweep(runs)
    rows, missing = [], []
    for run in runs:
        if (row := folder.finished(run)) is None:
            missing.append(run)
        else:
            rows.append({**row, **identity(run)})
    return rows, missing


def fly_all(runs: Sequence[Run], folder: SweepFolder, executor: Executor) -> Iterator[Json]:
    """Fly runs, store each result as it comes, and yield the rows as they finish.

    A run that failed is yielded but not stored: the next sweep tries it again. The executor is one of
    `concurrent.futures` or of `dask.distributed`. If the iteration is stopped, runs that have not started are
    cancelled.

    Raises:
        RelformError: a result cannot be stored.
    """
    pending: dict[Future[Any], Run] = {executor.submit(fly, run): run for run in runs}
    try:
        for future in as_completed(list(pending)):
            run = pending.pop(future)
            try:
                row, log = future.result()
            except Exception as error:  # the process or the machine that flew it was lost
                row, log = failed(run, str(error) or type(error).__name__), None
            if row["outcome"] != Outcome.FAILED:
                folder.store(run, row, log)
            # Rows share the names of their columns: each result of a process brings its own copies.
            yield {sys.intern(column): value for column, value in row.items()}
    finally:
        for future in pending:
            future.cancel()


def in_order(rows: Sequence[Json], runs: Sequence[Run]) -> list[Json]:
    """The rows in the order of their runs."""
    order = {(run.variant, run.seed): index for index, run in enumerate(runs)}
    return sorted(rows, key=lambda row: order[row["variant"], row["seed"]])
