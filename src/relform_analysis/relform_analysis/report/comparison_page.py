"""The page of a comparison: what differs, the paths over each other, and every quantity over time."""

from dataclasses import asdict
from pathlib import Path

from relform_analysis.comparison.compare import Comparison
from relform_analysis.comparison.flights import ComparedFlight
from relform_analysis.comparison.quantities import Course
from relform_analysis.flight.phases import flown_phases, step_times
from relform_analysis.flight.summary import Json, Outcome
from relform_analysis.plots.palette import vehicle_style
from relform_analysis.plots.panels import Line, Panel
from relform_analysis.report.packing import pack, pack_coarsely
from relform_analysis.report.page import PLOT_SCRIPTS, render
from relform_analysis.report.panel_data import panel_data
from relform_core.atomic_file import write_atomically
from relform_core.units import NANOSECONDS_PER_SECOND

SCRIPTS = (*PLOT_SCRIPTS, "playback.js", "paths.js", "comparison.js")
STYLES = ("comparison.css",)
HEADLINES = (
    "formation error, steady, mean",
    "formation error, maximum of all",
    "leader position error, steady, mean",
    "leader yaw error, steady, mean",
    "smallest separation",
    "rotor speed, standard deviation",
    "estimated relative position, error, steady, mean",
    "solver time per control step, median",
)
"""Results that the page shows first."""


def write_comparison(path: Path, comparison: Comparison) -> None:
    """Write the page.

    Raises:
        RelformError: it cannot be written.
    """
    write_atomically(path, comparison_page(comparison))


def comparison_page(comparison: Comparison) -> str:
    """The page, HTML."""
    return render(
        "comparison.html",
        SCRIPTS,
        comparison_data(comparison),
        STYLES,
        flights=comparison.flights,
        completed=Outcome.COMPLETED,
        differences=comparison.differences,
        results=comparison.results,
        headlines=[row for row in comparison.results if row.label in HEADLINES],
        phases=comparison.phases,
        titles={phase.name: phase.title for phase in flown_phases(comparison.flights[0].log)},
        common=comparison.common,
        limits=comparison.limits,
        equal=comparison.equal,
        line_styles=[vehicle_style(place) for place in range(len(comparison.flights))],
    )


def comparison_data(comparison: Comparison) -> Json:
    """The data that the page draws: lengths in metres, times in seconds, other units as in the panels."""
    logs = [flight.log for flight in comparison.flights]
    return {
        "period": min(log.scenario.config.controller.period for log in logs),
        "phases": [asdict(phase) for phase in flown_phases(logs[0])],
        "flights": [_path(flight, place) for place, flight in enumerate(comparison.flights)],
        "panels": [panel_data(_panel(course, comparison)) for course in comparison.courses],
    }


def _path(flight: ComparedFlight, place: int) -> Json:
    log = flight.log
    return {
        "label": flight.label,
        **asdict(vehicle_style(place)),
        "vehicles": list(log.vehicles),
        "leader": log.leader,
        "tick": pack(log.tick_ns / NANOSECONDS_PER_SECOND),
        "position": pack_coarsely(log.p_NB_N),
        "step": pack(step_times(log)),
    }


def _panel(course: Course, comparison: Comparison) -> Panel:
    """A plot with a line for each flight, which has instants of its own."""
    quantity = course.quantity
    lines = [
        Line(flight.label, vehicle_style(place), values)
        for place, (flight, values) in enumerate(zip(comparison.flights, course.values, strict=True))
    ]
    return Panel(
        quantity.title,
        quantity.unit,
        quantity.digits,
        lines,
        log_scale=quantity.log_scale,
        steps=quantity.steps,
        is_error=quantity.is_error,
        tall=quantity.is_main,
    )
