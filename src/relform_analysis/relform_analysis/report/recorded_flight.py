"""A recorded flight with its summary, from a bag, the folder of a run, or a replay."""

from dataclasses import dataclass
from pathlib import Path

from relform_analysis.flight.archive import is_kept_flight, read_kept_flight
from relform_analysis.flight.log import FlightLog
from relform_analysis.flight.summary import Json
from relform_analysis.report.flight_source import ending_from_run, summary_of, versions_from_bag
from relform_analysis.sweep.folder import RUNS, SWEEP_FILE
from relform_bags.reader import find_bag
from relform_bags.recording_lock import is_being_recorded
from relform_core.errors import BagError


@dataclass(frozen=True, eq=False)
class RecordedFlight:
    """A flight that was read."""

    bag: Path
    log: FlightLog
    summary: Json


def read_flight(source: Path, configuration: Path | str | None) -> RecordedFlight:
    """Read a recorded flight.

    Args:
        source: a bag, the folder of a run, or that of a replay.
        configuration: path or plain name of the scenario; None: as ``find_configuration`` finds it.
    Raises:
        RelformError: there is no flight.
    """
    bag = bag_of(source)
    if is_kept_flight(source):
        log = read_kept_flight(source)
        return RecordedFlight(bag, log, summary_of(log))
    # Reading serialized messages needs ROS; sweeps do without.
    from relform_analysis.flight.from_bag import read_flight_log

    log = read_flight_log(bag, configuration)
    ending, versions = ending_from_run(source) or (None, versions_from_bag(bag))
    return RecordedFlight(bag, log, summary_of(log, ending, versions))


def bag_of(source: Path) -> Path:
    """The bag of a flight, or the folder of a replay, which has none.

    Raises:
        BagError: there is none, and no sweep either, or it is still being recorded.
    """
    if is_kept_flight(source):
        return source
    try:
        bag = find_bag(source)
    except BagError as error:
        neither = f", and no sweep: there is no {SWEEP_FILE} in it" if source.is_dir() else ""
        if (source / RUNS).is_dir():
            neither += "; run the command of the sweep again, it continues and writes one"
        raise BagError(f"{error}{neither}") from None
    if is_being_recorded(bag):
        raise BagError(
            f"{bag}: the flight is not over: its recorder has the bag open; try again when it has ended"
        )
    return bag
