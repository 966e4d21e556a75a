"""A comparison of flights: configuration, results, courses over time, and what cannot be compared."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from relform_analysis.comparison.common import Common, common_of
from relform_analysis.comparison.configuration import Difference, configuration_differences
from relform_analysis.comparison.flights import ComparedFlight
from relform_analysis.comparison.quantities import Course, courses
from relform_analysis.comparison.results import Result, phase_results, results
from relform_analysis.flight.summary import Json, Outcome
from relform_core.errors import FlightError

FORMAT_VERSION = 1


@dataclass(frozen=True, eq=False)
class Comparison:
    """Flights beside each other; the first one is what the others are compared with."""

    flights: tuple[ComparedFlight, ...]
    differences: tuple[Difference, ...]
    """Of the configurations; empty: there are none."""
    common: Common
    results: tuple[Result, ...]
    phases: dict[str, list[Result]]
    """Numbers of the common phases, by name."""
    courses: tuple[Course, ...]
    limits: tuple[str, ...]
    """What cannot be compared, and why, a sentence each; empty: everything can."""
    equal: bool
    """Whether truth and commands of all flights are equal, bit for bit."""


def compare(flights: Sequence[ComparedFlight]) -> Comparison:
    """Compare two or more flights.

    Raises:
        FlightError: a flight has no control step.
    """
    for flight in flights:
        if not flight.log.phase:
            raise FlightError(f"{flight.source}: not compared: the flight has no control step")
    common = common_of(flights)
    over_time, lacking = courses(common.parts)
    return Comparison(
        flights=tuple(flights),
        differences=tuple(configuration_differences(flights)),
        common=common,
        results=tuple(results(common)),
        phases={name: phase_results(common, name) for name in common.phases},
        courses=tuple(over_time),
        limits=(*_early_ends(flights), *common.limits, *lacking),
        equal=all(_equal(flights[0], flight) for flight in flights[1:]),
    )


def _early_ends(flights: Sequence[ComparedFlight]) -> list[str]:
    """Flights that ended by a fault or a failure: errors until then mean little."""
    return [
        f"{flight.label} ended early ({flight.summary['reason']}): its numbers are of the time before."
        for flight in flights
        if flight.summary["outcome"] in (Outcome.FAULT, Outcome.FAILED)
    ]


def _equal(first: ComparedFlight, second: ComparedFlight) -> bool:
    return all(
        np.array_equal(getattr(first.log, name), getattr(second.log, name), equal_nan=True)
        for name in ("tick_ns", "p_NB_N", "q_NB", "rotor_speeds")
    )


def comparison_json(comparison: Comparison) -> Json:
    """The comparison as JSON: numbers in the units of their keys, None where there is none."""
    return {
        "format": FORMAT_VERSION,
        "flights": [
            {
                "label": flight.label,
                "source": flight.source,
                **{key: flight.summary[key] for key in ("scenario", "seed", "vehicles", "outcome", "reason")},
            }
            for flight in comparison.flights
        ],
        "equal": comparison.equal,
        "configuration": [
            {"section": row.section, "key": row.key, "values": list(row.values)}
            for row in comparison.differences
        ],
        "common": {
            "start_s": comparison.common.start,
            "end_s": comparison.common.end,
            "vehicles": _names(comparison, comparison.common.parts[0].vehicles),
            "pairs": [_names(comparison, pair) for pair in comparison.common.parts[0].pairs],
            "phases": list(comparison.common.phases),
        },
        "results": [_result(row) for row in comparison.results],
        "phases": {name: [_result(row) for row in rows] for name, rows in comparison.phases.items()},
        "not_comparable": list(comparison.limits),
    }


def _names(comparison: Comparison, vehicles: Sequence[int]) -> list[str]:
    names = comparison.flights[0].log.vehicles
    return [names[vehicle] for vehicle in vehicles]


def _result(row: Result) -> Json:
    others = range(len(row.values))
    return {
        "label": row.label,
        "unit": row.unit,
        "values": list(row.values),
        "differences": [row.difference(flight) for flight in others],
        "ratios": [row.ratio(flight) for flight in others],
    }
