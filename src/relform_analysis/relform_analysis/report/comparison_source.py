"""The flights of a comparison, from what the user names: runs, bags, and variants of a sweep."""

from collections.abc import Sequence
from pathlib import Path

from relform_analysis.comparison.flights import ComparedFlight, short_labels
from relform_analysis.flight.log import FlightLog
from relform_analysis.flight.summary import Json
from relform_analysis.report.recorded_flight import bag_of, read_flight
from relform_analysis.report.sweep_flight import is_sweep_flight, read_sweep_flight
from relform_analysis.report.sweep_source import is_sweep
from relform_core.errors import RelformError


def read_flights(sources: Sequence[str], configuration: Path | str | None) -> list[ComparedFlight]:
    """Read flights, each with a short label.

    Args:
        sources: a run, a bag, or ``SWEEP:VARIANT`` each.
        configuration: scenario of the bags, path or plain name; None: as ``find_configuration`` finds it.
    Raises:
        RelformError: one line: a source names no flight, or two name the same one.
    """
    _refuse_twice(sources)
    return [
        ComparedFlight(label, source, *_read(source, configuration))
        for source, label in zip(sources, short_labels(sources), strict=True)
    ]


def _read(source: str, configuration: Path | str | None) -> tuple[FlightLog, Json]:
    if is_sweep_flight(source):
        return read_sweep_flight(source)
    flight = read_flight(Path(source), configuration)
    return flight.log, flight.summary


def _refuse_twice(sources: Sequence[str]) -> None:
    """Check that every source is there, before any of them is read, and that none is named twice."""
    known: dict[str, str] = {}
    for source in sources:
        path = Path(source)
        if is_sweep(path):
            raise RelformError(f"{source}: a sweep of many flights; name one to compare, as {source}:VARIANT")
        flight = source if is_sweep_flight(source) else str(bag_of(path).resolve())
        if flight in known:
            raise RelformError(f"{known[flight]} and {source} are the same flight; name two different ones")
        known[flight] = source
