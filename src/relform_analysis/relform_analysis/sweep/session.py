"""A sweep on the terminal: its processes and its progress."""

import math
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor
from contextlib import contextmanager
from functools import partial

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
from relform_analysis.sweep.progress import ProgressLines
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
    """Fly the runs that are not stored yet; the rows of all runs, in their order.

    A terminal shows a live line, anything else gets a line every few seconds.
    """
    rows, missing = resume(runs, folder)
    with _shown(console, title, len(runs), rows) as update:
        lost = _lost(rows)
        for row in fly_all(missing, folder, executor):
            rows.append(row)
            lost += _lost([row])
            update(len(rows), lost)
    return in_order(rows, runs)


@contextmanager
def _shown(
    console: Console, title: str, total: int, rows: Sequence[Json]
) -> Iterator[Callable[[int, int], None]]:
    """Where to tell the numbers of flights that have ended, and of those that did not complete."""
    if not console.is_terminal:
        write = partial(console.print, soft_wrap=True, highlight=False, markup=False)
        yield ProgressLines(title, total, len(rows), write).update
        return
    with _live_line(console) as progress:
        task = progress.add_task(title, total=total, completed=len(rows), lost=_lost_text(_lost(rows)))
        yield lambda done, lost: progress.update(task, completed=done, lost=_lost_text(lost))


def _lost(rows: Sequence[Json]) -> int:
    return sum(row["outcome"] != Outcome.COMPLETED for row in rows)


def _lost_text(lost: int) -> str:
    return f"{lost} not completed" if lost else ""


def _live_line(console: Console) -> Progress:
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
