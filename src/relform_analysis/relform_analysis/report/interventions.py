"""What disturbed a flight or its estimator, or was changed in it, and when: rows of a table."""

from dataclasses import dataclass
from typing import Any

from relform_analysis.flight.log import FlightLog
from relform_core.units import NANOSECONDS_PER_SECOND

COMMON_KEYS = ("kind", "start_s", "end_s", "target")
"""Keys that every event of a scenario has."""


@dataclass(frozen=True)
class Intervention:
    """One row."""

    time: str
    """An instant or a span, with its unit."""
    subject: str
    """The vehicle that was disturbed, the node that was changed, or the estimator."""
    description: str


def interventions(log: FlightLog) -> list[Intervention]:
    """Imperfect links, events of the scenario, changes in flight, a degraded estimator; in time order."""
    timed = [(0.0, row) for row in _links(log)]
    timed += [(float(event["start_s"]), _event(event)) for event in log.scenario.written.get("events", ())]
    for change in log.changes:
        time = change.stamp_ns / NANOSECONDS_PER_SECOND
        timed.append((time, Intervention(f"{time:.2f} s", change.source, f"set: {change.description}")))
    for entry in log.degraded:
        time = entry.stamp_ns / NANOSECONDS_PER_SECOND
        timed.append((time, Intervention(f"{time:.2f} s", entry.source, entry.description)))
    return [row for _, row in sorted(timed, key=lambda entry: entry[0])]


def _links(log: FlightLog) -> list[Intervention]:
    rows = []
    for direction, keys in log.scenario.written.get("links", {}).items():
        if acting := [f"{key} = {value}" for key, value in keys.items() if value]:
            rows.append(Intervention("all the time", f"all links, {direction}", ", ".join(acting)))
    return rows


def _event(event: dict[str, Any]) -> Intervention:
    details = [f"{key} = {value}" for key, value in event.items() if key not in COMMON_KEYS]
    description = ", ".join([str(event["kind"]).replace("_", " "), *details])
    return Intervention(f"{event['start_s']:g} to {event['end_s']:g} s", str(event["target"]), description)
