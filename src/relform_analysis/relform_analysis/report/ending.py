"""How a flight that did not complete ended, in words; its numbers of steady state are not shown."""

from relform_analysis.flight.log import FlightLog
from relform_analysis.flight.summary import Json, Outcome

WORDS = {Outcome.FAULT: "Crashed", Outcome.INTERRUPTED: "Interrupted", Outcome.FAILED: "Failed"}


def ending_words(log: FlightLog, summary: Json) -> str:
    """What ended the flight, when, and in which phase."""
    planned = summary["steps_planned"] * log.scenario.config.controller.period
    word = WORDS[Outcome(summary["outcome"])]
    return f"{word} at {log.flown:.2f} s of {planned:g} s, in phase {log.phase[-1]}."


def end_reasons(log: FlightLog, reason: str | None) -> list[str]:
    """Why it ended: the reason of its end, if no fault gives the same, and the faults."""
    faults = [fault.description for fault in log.faults]
    return ([reason] if reason and reason not in faults else []) + faults


def is_steady(key: str) -> bool:
    """Whether a number of summary.json is of steady state."""
    return key.startswith("steady_") or "_steady_" in key
