"""The report of one flight."""

from dataclasses import asdict
from pathlib import Path

from relform_analysis.flight.log import FlightLog
from relform_analysis.flight.paper_claims import COMPARED, FOOTNOTE, FORMATION_STEADY_MEAN_M
from relform_analysis.flight.paper_scenario import flown_title, is_paper
from relform_analysis.flight.phases import flown_phases, step_times
from relform_analysis.flight.summary import Json, Outcome
from relform_analysis.flight.tracking_errors import formation_errors, scored_pairs
from relform_analysis.plots.constraint_panels import constraint_panels
from relform_analysis.plots.estimation_panels import estimation_panels
from relform_analysis.plots.palette import vehicle_style
from relform_analysis.plots.panels import Panel, flight_panels, pair_label, rotor_summary
from relform_analysis.report.compared_rows import compared_rows
from relform_analysis.report.ending import end_reasons, ending_words, is_steady
from relform_analysis.report.error_rows import STATISTICS, error_columns, error_rows
from relform_analysis.report.flight_source import unrecorded_topics
from relform_analysis.report.happenings import happenings
from relform_analysis.report.packing import pack, pack_coarsely
from relform_analysis.report.page import PLOT_SCRIPTS, render
from relform_analysis.report.panel_data import panel_data
from relform_analysis.report.tiles import LABELS, headline_tiles
from relform_core.atomic_file import write_atomically
from relform_core.errors import FlightError
from relform_core.units import NANOSECONDS_PER_SECOND

SCRIPTS = (
    *PLOT_SCRIPTS,
    "playback.js",
    "camera.js",
    "brush.js",
    "poses.js",
    "drawing.js",
    "overview.js",
    "scene.js",
    "grip.js",
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
    completed, compared_to_paper = summary["outcome"] == Outcome.COMPLETED, is_paper(log.scenario.config)
    return render(
        "flight.html",
        SCRIPTS,
        flight_data(log),
        title=flown_title(log.scenario.config),
        summary=summary,
        completed=completed,
        ending=None if completed else ending_words(log, summary),
        reasons=end_reasons(log, summary["reason"]),
        unrecorded=unrecorded_topics(log),
        tiles=headline_tiles(
            summary.get,
            _notes(summary, compared_to_paper),
            [key for key in LABELS if completed or not is_steady(key)],
        ),
        is_paper=compared_to_paper,
        compared=compared_rows(summary, compared_to_paper),
        footnote=FOOTNOTE,
        columns=error_columns(summary),
        errors=error_rows(summary),
        statistics=STATISTICS,
        configuration=log.scenario.effective_yaml,
        happenings=happenings(log),
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
        "phases": [asdict(phase) for phase in flown_phases(log)],
        "pairs": [
            {"name": pair_label(observer, target), "vehicles": [index[observer], index[target]]}
            for observer, target in pairs
        ],
        "tick": pack(log.tick_ns / NANOSECONDS_PER_SECOND),
        "position": pack(log.p_NB_N),
        "attitude": pack_coarsely(log.q_NB),
        "step": pack(step_times(log)),
        "reference": pack(log.leader_p_NB_N__ref),
        "formation": pack_coarsely(log.p_BB_C__ref[:, log.leader]),
        "error": pack_coarsely(formation_errors(log, pairs)),
        "happenings": [{"start": each.start, "end": each.end, "kind": each.kind} for each in happenings(log)],
        "sections": [
            {"title": title, "closed": closed, "panels": [panel_data(panel) for panel in panels]}
            for title, closed, panels in _sections(log)
            if panels
        ],
    }


def _sections(log: FlightLog) -> list[tuple[str, bool, list[Panel]]]:
    """Title, whether it is folded, and plots of each section of the page."""
    figures = flight_panels(log)
    return [
        ("", False, [*figures["formation_errors"], *figures["tracking_errors"], *constraint_panels(log)]),
        ("Rotors and solver", False, [rotor_summary(log), *figures["solver"]]),
        ("Single rotors", True, figures["rotor_speeds"]),
        ("Estimator", False, estimation_panels(log)),
    ]


def _notes(summary: Json, compared_to_paper: bool) -> dict[str, str]:
    compared = {row.key: row for row in COMPARED}

    def text(key: str) -> str:
        return compared[key].text(summary[key])

    def paper(words: str, key: str) -> str:
        return f"{words}; the paper {compared[key].paper}" if compared_to_paper else words

    completed = summary["outcome"] == Outcome.COMPLETED
    return {
        "steady_mean_m": paper("mean", "steady_mean_m"),
        "peak_m": f"in steady state {text('steady_max_m')}" if completed else "of a pair",
        "leader_steady_mean_m": f"mean; in yaw {text('leader_yaw_steady_mean_deg')}",
        "separation_min_m": "between two centres",
        "rotor_std_rpm": paper("std. dev.", "rotor_std_rpm"),
        "step_ms_median": paper("median", "step_ms_median"),
    }
