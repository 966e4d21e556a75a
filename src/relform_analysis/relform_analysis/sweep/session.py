"""A sweep on the terminal: its processes and its progress."""

import math
from collections.abc import Iterator, Sequence
from concurrent.futures import Executor
from contextlib import contextmanager

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)

from relform_analysis.flight.summary import Json, Outcome
from relform_analysis.sweep.folder import SweepFolder
from relform_analysis.sweep.plan import Run
from relform_analysis.sweep.runs import fly_all, in_order, resume
from relform_analysis.sweep.workers import LocalProcesses
from relform_core.errors import RelformError


@contextmanager
def executor_for(jobs: int, scheduler: str | None) -> Iterator[Executor]:
    """Local processes, or a Dask cluster; running flights end with the block.

    Raises:
        RelformError: the cluster cannot be reached, or Dask is not installed.
    """
    if scheduler is None:
        executor = LocalProcesses(jobs)
        try:
            yield executor
        finally:
            executor.shutdown(cancel_futures=True)
        return
    try:
        from distributed import Client
    except ModuleNotFoundError:
        raise RelformError("--scheduler needs Dask: pip install distributed") from None
    try:
        client = Client(scheduler, timeout="10s", set_as_default=False)
    except (OSError, ValueError) as error:
        raise RelformError(f"--scheduler {scheduler}: no cluster answers: {error}") from None
    with client:
        yield client.get_executor(pure=False)


def fly_shown(
    runs: Sequence[Run], folder: SweepFolder, executor: Executor, console: Console, title: str = "flying"
) -> list[Json]:
    """Fly the runs that are not stored yet, with a progress bar; the rows of all runs, in their order."""
    rows, missing = resume(runs, folder)
    with _progress(console) as progress:
        task = progress.add_task(title, total=len(runs), completed=len(rows), lost=_lost(rows))
        for row in fly_all(missing, folder, executor):
            rows.append(row)
            progress.update(task, completed=len(rows), lost=_lost(rows))
    return in_order(rows, runs)


def _lost(rows: Sequence[Json]) -> str:
    lost = sum(row["outcome"] != Outcome.COMPLETED for row in rows)
    return f"{lost} not completed" if lost else ""


def _progress(console: Console) -> Progress:
    return Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TextColumn("[dim]left"),
        TimeRemainingColumn(),
        TextColumn("[red]{task.fields[lost]}"),
        console=console,
        speed_estimate_period=math.inf,  # a flight may take longer than the 30 s that rich looks back
    )
