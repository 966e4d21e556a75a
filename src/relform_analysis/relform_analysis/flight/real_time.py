"""How a flight kept to the wall clock, from what its nodes reported on /diagnostics."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from relform_analysis.flight.log import FlightLog
from relform_core.names import CLOCK_NODE, vehicle_node
from relform_core.roster import Roster

MISSED = "real_time.missed_steps."
HELD = "real_time.held_s"
AGE = "real_time.age"


@dataclass(frozen=True)
class Ages:
    """How old data was when it was used [ms]."""

    median: float
    percentile_99: float
    most: float


@dataclass(frozen=True)
class RealTimeMetrics:
    """Steps that were late, and the age of data, of the nodes where it was oldest."""

    missed_steps: Mapping[str, int]
    """By node, the steps that it had not finished when the next one began."""
    held: float
    """Time for which steps were held back because vehicles were late [s]."""
    measurements: Ages | None
    """From the instant of measurements to the decision; None: not reported."""
    commands: Ages | None
    """From the instant of measurements to the arrival of the command; likewise."""


def real_time_metrics(log: FlightLog) -> RealTimeMetrics | None:
    """Of a whole flight; None: it was in lock-step, or its nodes have reported nothing."""
    if not log.real_time:
        return None
    of_clock = log.real_time.get(CLOCK_NODE, {})
    missed = {
        key.removeprefix(MISSED): int(number) for key, number in of_clock.items() if key.startswith(MISSED)
    }
    controllers = [controller.node for controller in Roster.of(log.scenario.config).controllers]
    return RealTimeMetrics(
        missed,
        of_clock.get(HELD, 0.0),
        _oldest(log, controllers),
        _oldest(log, map(vehicle_node, log.vehicles)),
    )


def _oldest(log: FlightLog, nodes: Iterable[str]) -> Ages | None:
    """The greatest ages of some nodes."""
    reports = [log.real_time[node] for node in nodes if node in log.real_time]
    if not reports:
        return None
    median, percentile_99, most = (
        max(report[f"{AGE}_{what}_ms"] for report in reports) for what in ("median", "99_percent", "most")
    )
    return Ages(median, percentile_99, most)
