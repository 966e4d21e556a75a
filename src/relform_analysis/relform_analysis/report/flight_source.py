"""How a recorded flight ended and which software flew it, from its bag or the files beside the bag."""

import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from relform_analysis.flight.log import FlightLog
from relform_analysis.flight.metrics import flight_metrics
from relform_analysis.flight.summary import Ending, Json, Outcome, build_summary
from relform_analysis.report.json_file import read_json
from relform_bags.reader import read_attachments
from relform_core.errors import RelformError
from relform_core.names import ROTOR_SPEEDS, SOLVER, VERSIONS_ATTACHMENT, vehicle_topic
from relform_core.run_folder import RunFolder

Versions = Mapping[str, str | None]


def ending_from_log(log: FlightLog) -> Ending:
    """How a flight ended, as far as its log shows."""
    config = log.scenario.config
    if log.faults:
        return Ending(Outcome.FAULT, log.faults[0].description, 0.0, log.flown)
    # The last instant counts: a flight that starts late, or ends on the ground, has fewer steps.
    reached = max(int(log.step_ns[-1]) // config.period_ns + 1, int(log.tick_ns[-1]) // config.period_ns)
    if reached < config.n_steps:
        reason = f"The recording ends after {reached} of {config.n_steps} control steps."
        return Ending(Outcome.INTERRUPTED, reason, 0.0, log.flown)
    return Ending(Outcome.COMPLETED, None, 0.0, log.flown)


def summary_of(log: FlightLog, ending: Ending | None = None, versions: Versions | None = None) -> Json:
    """Content of summary.json for a flight; without an ending, that of the log."""
    return build_summary(log.scenario, flight_metrics(log), ending or ending_from_log(log), versions or {})


def unrecorded_topics(log: FlightLog) -> list[str]:
    """Topics without any message in the log; a report leaves their numbers blank."""
    topics = {
        vehicle_topic(name, ROTOR_SPEEDS): log.rotor_speeds[:, index]
        for index, name in enumerate(log.vehicles)
    }
    topics[SOLVER] = log.solver["status"]
    return [topic for topic, values in topics.items() if not np.isfinite(values).any()]


def ending_from_run(folder: Path) -> tuple[Ending, Versions] | None:
    """How a flight ended and which software flew it, from the summary in its run folder; None without one.

    Raises:
        RelformError: the summary cannot be used.
    """
    file = RunFolder(folder).summary
    if not file.is_file():
        return None
    summary = read_json(file)
    try:
        ending = Ending(
            Outcome(summary["outcome"]),
            summary["reason"],
            float(summary["wall_s"]),
            float(summary["flown_s"]),
        )
        return ending, dict(summary["versions"])
    except (KeyError, TypeError, ValueError) as error:
        raise RelformError(f"{file}: not the summary of a flight: {error!r}") from None


def versions_from_bag(file: Path) -> Versions:
    """The software versions that the recorder wrote into the bag; empty if it wrote none.

    Raises:
        RelformError: the file cannot be read.
    """
    try:
        versions = json.loads(read_attachments(file).get(VERSIONS_ATTACHMENT, "{}"))
    except ValueError:
        return {}
    return versions if isinstance(versions, dict) else {}
