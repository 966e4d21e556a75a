"""Many flights over seeds and variants of a scenario: flown in parallel, and resumable at any time.

Each finished run is stored at once under a fingerprint of everything that it depends on: what is there is not
flown again, and what no longer fits is.
"""

import time
from collections.abc import Iterator, Sequence
from concurrent.futures import Executor, Future, as_completed
from typing import Any

from relform_analysis.flight.log import FlightLog
from relform_analysis.flight.summary import Ending, Json, Outcome, build_summary
from relform_analysis.sweep.folder import SweepFolder
from relform_analysis.sweep.plan import Run
from relform_analysis.sweep.software import flight_software
from relform_analysis.sweep.statistics import flatten
from relform_core.errors import RelformError
from relform_core.units import NANOSECONDS_PER_SECOND


def fly(run: Run) -> tuple[Json, FlightLog | None]:
    """Fly one run in this process: its row, and its log if the run keeps it.

    Never raises: whatever goes wrong is an outcome with its reason.
    """
    try:
        return _fly(run)
    except RelformError as error:
        return _failed(run, str(error)), None
    except Exception as error:  # a bug, or a library at its end: one lost run, not a lost sweep
        return _failed(run, f"{type(error).__name__}: {error}"), None


def resume(runs: Sequence[Run], folder: SweepFolder) -> tuple[list[Json], list[Run]]:
    """Rows of the runs that have been flown, and the runs that have not."""
    rows, missing = [], []
    for run in runs:
        if (row := folder.finished(run)) is None:
            missing.append(run)
        else:
            rows.append(row)
    return rows, missing


def fly_all(runs: Sequence[Run], folder: SweepFolder, executor: Executor) -> Iterator[Json]:
    """Fly runs, store each result as it comes, and yield the rows as they finish.

    A run that failed is yielded but not stored: the next sweep tries it again. An executor of
    `concurrent.futures` or of `dask.distributed` does. If the iteration is given up, runs that have not
    started are cancelled.

    Raises:
        RelformError: a result cannot be stored.
    """
    pending: dict[Future[Any], Run] = {executor.submit(fly, run): run for run in runs}
    try:
        for future in as_completed(list(pending)):
            run = pending.pop(future)
            try:
                row, log = future.result()
            except Exception as error:  # the executor lost the process or the machine that flew it
                row, log = _failed(run, str(error) or type(error).__name__), None
            if row["outcome"] != Outcome.FAILED:
                folder.store(run, row, log)
            yield row
    finally:
        for future in pending:
            future.cancel()


def in_order(rows: Sequence[Json], runs: Sequence[Run]) -> list[Json]:
    """The rows in the order of their runs."""
    order = {(run.variant, run.seed): index for index, run in enumerate(runs)}
    return sorted(rows, key=lambda row: order[row["variant"], row["seed"]])


def _fly(run: Run) -> tuple[Json, FlightLog | None]:
    if flight_software() != run.software:
        raise RelformError("the process that was to fly it has other software than the one that planned it")
    # Imported here, in the worker: the process that only plans and counts needs no CasADi.
    from relform_analysis.flight.metrics import flight_metrics
    from relform_analysis.flight.simulate import fly_in_process

    begin = time.perf_counter()
    log = fly_in_process(run.scenario)
    wall_time = time.perf_counter() - begin
    outcome, reason = Outcome.COMPLETED, None
    if log.faults:
        outcome, reason = Outcome.FAULT, log.faults[0].description
    ending = Ending(outcome, reason, wall_time, float(log.tick_ns[-1]) / NANOSECONDS_PER_SECOND)
    summary = build_summary(run.scenario, flight_metrics(log), ending, versions={})
    return {**_identity(run), **flatten(summary)}, log if run.keeps_log else None


def _failed(run: Run, reason: str) -> Json:
    scenario = run.scenario.config.name
    return {
        **_identity(run),
        "scenario": scenario,
        "outcome": Outcome.FAILED.value,
        "reason": " ".join(reason.split()),
    }


def _identity(run: Run) -> Json:
    return {"variant": run.variant, "seed": run.seed}
