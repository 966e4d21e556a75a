"""The report of one flight."""

from dataclasses import asdict
from pathlib import Path

from relform_analysis.flight.log import FlightLog
from relform_analysis.flight.paper_claims import COMPARED, FOOTNOTE, FORMATION_STEADY_MEAN_M
from relform_analysis.flight.phases import flown_phases, step_times
from relform_analysis.flight.summary import Json, Outcome
from relform_analysis.flight.tracking_errors import formation_errors, scored_pairs
from relform_analysis.plots.constraint_panels import constraint_panels
from relform_analysis.plots.estimation_panels import estimation_panels
from relform_analysis.plots.palette import vehicle_style
from relform_analysis.plots.panels import Panel, flight_panels, pair_label
from relform_analysis.report.error_rows import STATISTICS, error_columns, error_rows
from relform_analysis.report.flight_source import unrecorded_topics
from relform_analysis.report.interventions import interventions
from relform_analysis.report.packing import pack
from relform_analysis.report.page import render
from relform_analysis.report.real_time_rows import real_time_rows
from relform_analysis.report.tiles import headline_tiles
from relform_core.atomic_file import write_atomically
from relform_core.errors import FlightError
from relform_core.units import NANOSECONDS_PER_SECOND

SCRIPTS = (
    "base.js",
    "playback.js",
    "camera.js",
    "brush.js",
    "poses.js",
    "drawing.js",
    "overview.js",
    "scene.js",
    "grip.js",
    "plots.js",
    "timeline.js",
    "flight.js",
)


def write_flight_report(path: Path | str, log: FlightLog, summary: Json) -> None:
    """Write the report of a flight.

    Args:
        summary: of the same flight, as ``build_summary`` makes it.
    Raises:
        FlightError: the flight has no control step.
        RelformError: it cannot be written.
    """
    if not log.phase:
        raise FlightError(f"{path}: no report: the flight has no control step")
    write_atomically(path, flight_page(log, summary))


def flight_page(log: FlightLog, summary: Json) -> str:
    """The report of a flight, HTML; arguments as of ``write_flight_report``."""
    return render(
        "flight.html",
        SCRIPTS,
        flight_data(log),
        summary=summary,
        completed=summary["outcome"] == Outcome.COMPLETED,
        reasons=_reasons(log, summary["reason"]),
        unrecorded=unrecorded_topics(log),
        tiles=headline_tiles(summary.get, _notes(summary)),
        compared=[
            *(
                (row.label, row.text(summary[row.key]), row.paper, row.holds(summary[row.key]))
                for row in COMPARED
                if row.paper or summary[row.key] is not None
            ),
            *((label, text, "", None) for label, text in real_time_rows(summary)),
        ],
        footnote=FOOTNOTE,
        columns=error_columns(summary),
        errors=error_rows(summary),
        statistics=STATISTICS,
        configuration=log.scenario.effective_yaml,
        interventions=interventions(log),
        changed=bool(log.changes),
    )


def flight_data(log: FlightLog) -> Json:
    """The data that the page draws: lengths in metres, times in seconds, other units as in the panels."""
    config = log.scenario.config
    pairs = scored_pairs(config.team)
    index = {name: position for position, name in enumerate(log.vehicles)}
    return {
        "vehicles": list(log.vehicles),
        "styles": [asdict(vehicle_style(place)) for place in range(len(log.vehicles))],
        "leader": log.leader,
        "arm": config.vehicle.arm_length,
        "period": config.controller.period,
        "claim": FORMATION_STEADY_MEAN_M,
        "phases": [
            {
                "name": phase.name,
                "title": phase.title,
                "start": phase.start,
                "steady": phase.steady,
                "end": phase.end,
            }
            for phase in flown_phases(log)
        ],
        "pairs": [
            {"name": pair_label(observer, target), "vehicles": [index[observer], index[target]]}
            for observer, target in pairs
        ],
        "tick": pack(log.tick_ns / NANOSECONDS_PER_SECOND),
        "position": pack(log.p_NB_N),
        "attitude": pack(log.q_NB),
        "step": pack(step_times(log)),
        "reference": pack(log.leader_p_NB_N__ref),
        "formation": pack(log.p_BB_C__ref[:, log.leader]),
        "error": pack(formation_errors(log, pairs)),
        "panels": [_panel(panel) for panel in _panels(log)],
    }


def _panels(log: FlightLog) -> list[Panel]:
    """Errors, soft constraints, then the estimator, then rotors and solver."""
    figures = flight_panels(log)
    errors = [*figures.pop("formation_errors"), *figures.pop("tracking_errors"), *constraint_panels(log)]
    return [*errors, *estimation_panels(log), *(panel for panels in figures.values() for panel in panels)]


def _panel(panel: Panel) -> Json:
    return {
        "title": panel.title,
        "unit": panel.unit,
        "digits": panel.digits,
        "log": panel.log_scale,
        "steps": panel.steps,
        "guides": [{"label": guide.label, "values": guide.values} for guide in panel.guides],
        "lines": [
            {
                "name": line.name,
                **asdict(line.style),
                "values": pack(line.values),
                "band": None if line.band is None else pack(line.band),
            }
            for line in panel.lines
        ],
    }


def _reasons(log: FlightLog, reason: str | None) -> list[str]:
    """Why a flight did not complete: the reason of its end, if no fault gives the same, and the faults."""
    known = {fault.description for fault in log.faults}
    faults = [
        f"at {fault.stamp_ns / NANOSECONDS_PER_SECOND:.2f} s, {fault.description}" for fault in log.faults
    ]
    return ([reason] if reason and reason not in known else []) + faults


def _notes(summary: Json) -> dict[str, str]:
    compared = {row.key: row for row in COMPARED}

    def text(key: str) -> str:
        return compared[key].text(summary[key])

    return {
        "steady_mean_m": f"mean; the paper {compared['steady_mean_m'].paper}",
        "peak_m": f"in steady state {text('steady_max_m')}",
        "leader_steady_mean_m": f"mean; in yaw {text('leader_yaw_steady_mean_deg')}",
        "separation_min_m": "between two centres",
        "rotor_std_rpm": f"std. dev.; paper {compared['rotor_std_rpm'].paper}",
        "step_ms_median": f"median; the paper {compared['step_ms_median'].paper}",
    }
