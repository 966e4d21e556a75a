"""How a flight that did not complete ended, in words; its numbers of steady state are not shown."""

from relform_analysis.flight.log import FlightLog
from relform_analysis.flight.summary import Json, Outcome
from relform_core.units import NANOSECONDS_PER_SECOND

WORDS = {Outcome.FAULT: "Crashed", Outcome.INTERRUPTED: "Interrupted", Outcome.FAILED: "Failed"}


def ending_words(log: FlightLog, summary: Json) -> str:
    """What ended the flight, when, and in which phase."""
    planned = summary["steps_planned"] * log.scenario.config.controller.period
    where = f"in phase {log.phase[-1]}, after {summary['steps']} of {summary['steps_planned']} control steps"
    return f"{WORDS[Outcome(summary['outcome'])]} at {log.flown:.2f} s of {planned:g} s, {where}."


def end_reasons(log: FlightLog, reason: str | None) -> list[str]:
    """Why it ended: the reason of its end, if no fault gives the same, and the faults."""
    faults = {fault.description: fault for fault in log.faults}
    words = [
        f"At {fault.stamp_ns / NANOSECONDS_PER_SECOND:.2f} s, {words}" for words, fault in faults.items()
    ]
    return ([reason] if reason and reason not in faults else []) + words


def is_steady(key: str) -> bool:
    """Whether a number of summary.json is of steady state."""
    return key.startswith("steady_") or "_steady_" in key
