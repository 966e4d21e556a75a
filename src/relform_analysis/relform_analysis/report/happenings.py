"""What disturbed or changed a flight, and when: rows of a table, and marks in plots over time."""

from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import numpy as np

from relform_analysis.flight.log import FlightLog, LogEntry
from relform_analysis.flight.phases import step_times
from relform_core.arrays import Mask
from relform_core.names import EstimatorMode, SolverState
from relform_core.units import NANOSECONDS_PER_SECOND

COMMON_KEYS = ("kind", "start_s", "end_s", "target")
"""Keys that every event of a scenario has."""
JOINED_S = 0.5
"""Spans that are closer than this count as one [s]."""


class Kind(StrEnum):
    """Who or what caused it."""

    DISTURBANCE = "disturbance"
    """The scenario: an event, or imperfect links."""
    CHANGE = "change"
    """A user or the mission: parameters, formations, requests, modes."""
    TROUBLE = "trouble"
    """The flight itself: a degraded estimator, an active constraint, a fallback, an alarm, a fault."""


@dataclass(frozen=True)
class Happening:
    """One of them."""

    start: float
    """[s]."""
    end: float | None
    """[s]; None: it was an instant."""
    kind: Kind
    subject: str
    """The vehicle, node or part of the controller that it was about."""
    description: str

    @property
    def time(self) -> str:
        """An instant or a span, with its unit."""
        return f"{self.start:.2f} s" if self.end is None else f"{self.start:.2f} to {self.end:.2f} s"


def happenings(log: FlightLog) -> list[Happening]:
    """All of a flight, in time order; events of the scenario only as far as the flight reached them."""
    found = [
        *_links(log),
        *(_event(event) for event in log.scenario.written.get("events", ()) if event["start_s"] < log.flown),
        *(_instant(entry, Kind.CHANGE) for entry in log.changes),
        *(_degraded(log, entry) for entry in log.degraded),
        *_fallbacks(log),
        *_constraints(log),
        *(_instant(entry, Kind.TROUBLE) for entry in (*log.alarms, *log.faults)),
    ]
    return sorted(found, key=lambda happening: happening.start)


def _links(log: FlightLog) -> Iterator[Happening]:
    for direction, keys in log.scenario.written.get("links", {}).items():
        if acting := [f"{key} = {value}" for key, value in keys.items() if value]:
            yield Happening(0.0, log.flown, Kind.DISTURBANCE, f"all links, {direction}", ", ".join(acting))


def _event(event: dict[str, Any]) -> Happening:
    details = [f"{key} = {value}" for key, value in event.items() if key not in COMMON_KEYS]
    description = ", ".join([str(event["kind"]).replace("_", " "), *details])
    start, end = float(event["start_s"]), float(event["end_s"])
    return Happening(start, end, Kind.DISTURBANCE, str(event["target"]), description)


def _instant(entry: LogEntry, kind: Kind) -> Happening:
    return Happening(entry.stamp_ns / NANOSECONDS_PER_SECOND, None, kind, entry.source, entry.description)


def _degraded(log: FlightLog, entry: LogEntry) -> Happening:
    start, times = entry.stamp_ns / NANOSECONDS_PER_SECOND, step_times(log)
    better = times[(times > start) & (log.estimator["mode"] != EstimatorMode.DEGRADED)]
    end = float(better[0]) if len(better) else log.flown
    return Happening(start, end, Kind.TROUBLE, entry.source, entry.description)


def _fallbacks(log: FlightLog) -> Iterator[Happening]:
    for start, end, steps in _spans(log, log.solver["status"] == SolverState.FALLBACK):
        yield Happening(
            start, end, Kind.TROUBLE, "solver", f"fallback to the plan before in {steps} control steps"
        )


def _constraints(log: FlightLog) -> Iterator[Happening]:
    for name, active in log.active_constraints.items():
        for start, end, steps in _spans(log, active):
            yield Happening(
                start, end, Kind.TROUBLE, "soft constraint", f"{name} active in {steps} control steps"
            )


def _spans(log: FlightLog, holds: Mask) -> Iterator[tuple[float, float, int]]:
    """Start and end [s] and number of steps of each stretch in which a condition holds, with short breaks."""
    times, period = step_times(log)[holds], log.scenario.config.controller.period
    for part in np.split(times, np.flatnonzero(np.diff(times) > JOINED_S) + 1):
        if len(part):
            yield float(part[0]), float(part[-1]) + period, len(part)
