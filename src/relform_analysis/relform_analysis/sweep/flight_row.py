"""One flight of a sweep, as a row of its table."""

import time

from relform_analysis.flight.log import FlightLog
from relform_analysis.flight.metrics import flight_metrics
from relform_analysis.flight.summary import Ending, Json, Outcome, build_summary
from relform_analysis.sweep.plan import Run
from relform_analysis.sweep.software import flight_software
from relform_analysis.sweep.statistics import flatten
from relform_core.errors import RelformError


def fly(run: Run) -> tuple[Json, FlightLog | None]:
    """Fly one run in this process: its row, and its log if the run keeps it.

    Never raises: a failure becomes an outcome with its reason.
    """
    try:
        return _fly(run)
    except RelformError as error:
        return failed(run, str(error)), None
    except Exception as error:  # a bug must cost one run, not the sweep
        return failed(run, f"{type(error).__name__}: {error}"), None


def failed(run: Run, reason: str) -> Json:
    """The row of a run that could not be flown."""
    scenario = run.scenario.config.name
    return {
        **identity(run),
        "scenario": scenario,
        "outcome": Outcome.FAILED.value,
        "reason": " ".join(reason.split()),
    }


def identity(run: Run) -> Json:
    """The columns that identify a run: variant, seed, and the keys that were changed for it."""
    return {"variant": run.variant, "seed": run.seed, "set": "; ".join(run.changes)}


def _fly(run: Run) -> tuple[Json, FlightLog | None]:
    if flight_software() != run.software:
        raise RelformError(
            "the process that should fly it has other software than the process that planned it"
        )
    # Imported here, in the worker: the process that only plans and counts needs no CasADi.
    from relform_analysis.flight.simulate import fly_in_process

    begin = time.perf_counter()
    log = fly_in_process(run.scenario)
    wall_time = time.perf_counter() - begin
    outcome, reason = Outcome.COMPLETED, None
    if log.faults:
        outcome, reason = Outcome.FAULT, log.faults[0].description
    ending = Ending(outcome, reason, wall_time, log.flown)
    summary = build_summary(run.scenario, flight_metrics(log), ending, versions={})
    return {**identity(run), **flatten(summary)}, log if run.keeps_log else None
