"""The numbers beside the scene, as a piece of a web page; it takes its text colour from the page."""

import html
import math
from collections.abc import Sequence

import numpy as np

from relform_core.flight_modes import TeamMode
from relform_core.names import EstimatorMode, SolverState
from relform_core.units import NANOSECONDS_PER_SECOND
from relform_live.scene.colours import css, of_errors
from relform_live.scene.flight_data import ALARMS, FlightData, LogLine, Severity
from relform_live.scene.stage import Stage

_GOOD, _WARNING, _BAD = "#26a69a", "#ffb300", "#e53935"
_SEVERITY = {Severity.NOTE: "inherit", Severity.WARNING: _WARNING, Severity.ERROR: _BAD}
_ESTIMATOR = {EstimatorMode.MEASURED: _GOOD, EstimatorMode.PREDICTED: _WARNING, EstimatorMode.DEGRADED: _BAD}
_SOLVER = {SolverState.SOLVED: _GOOD, SolverState.STEP_LIMIT: _GOOD, SolverState.FALLBACK: _BAD}
_LINES = 12
"""Of the log, newest first."""


def readout(data: FlightData, stage: Stage, stamp_ns: int, rate: float | None) -> str:
    """The state of the flight.

    Args:
        stamp_ns: instant that is shown.
        rate: simulation time by wall time; None: not known.
    """
    speed = "" if rate is None else f"{rate:.1f} × real time"
    return (
        '<div style="padding:0 0.9em;font-size:0.85em;line-height:1.5">'
        '<div style="display:flex;align-items:baseline;gap:0.8em">'
        f'<span style="font-size:1.7em;font-variant-numeric:tabular-nums">'
        f"{stamp_ns / NANOSECONDS_PER_SECOND:.1f} s</span>"
        f'<span style="font-size:1.2em">{_doing(data)}</span>'
        f'<span style="margin-left:auto;opacity:0.6">{speed}</span></div>'
        f"{_table(_team_rows(data))}{_vehicle_table(data, stage)}</div>"
    )


def log_text(lines: Sequence[LogLine]) -> str:
    """What happened, newest first."""
    rows = [
        f'<div style="color:{_SEVERITY[line.severity]}"><span style="opacity:0.6">'
        f"{line.stamp_ns / NANOSECONDS_PER_SECOND:.1f} s</span> {html.escape(line.text)}</div>"
        for line in reversed(list(lines)[-_LINES:])
    ]
    body = "".join(rows) or '<span style="opacity:0.6">nothing yet</span>'
    return f'<div style="padding:0 0.9em 0.5em;font-size:0.8em;line-height:1.5">{body}</div>'


def waiting(text: str) -> str:
    """A notice in place of the numbers."""
    return f'<div style="padding:0.5em 0.9em">{html.escape(text)}</div>'


def _doing(data: FlightData) -> str:
    """What the team does, in a few words."""
    phase = "" if data.state is None else f"phase {html.escape(data.state.value.phase)}"
    if data.status is None:
        return phase
    mode = data.status.mode
    colour = _BAD if mode in ALARMS else _GOOD
    return _chip(str(mode), colour) + (f" {phase}" if mode is TeamMode.FLYING else "")


def _team_rows(data: FlightData) -> list[tuple[str, str]]:
    rows = []
    if errors := list(data.formation_errors().values()):
        rows.append(("formation error", f"{np.mean(errors):.3f} m (largest {max(errors):.3f} m)"))
    if (error := data.leader_error()) is not None:
        rows.append(("leader from its path", f"{error:.3f} m"))
    if data.state is not None and (estimator := data.state.value.estimator) is not None:
        mode = _chip(estimator.mode.name.lower(), _ESTIMATOR[estimator.mode])
        per_degree = "" if math.isnan(estimator.nis) else f" NIS {estimator.nis / estimator.nis_dof:.2f}"
        rows.append(("estimator", f"{mode}{per_degree} {html.escape(estimator.reason)}"))
    if data.solver is not None:
        solver = data.solver.value
        chip = _chip(solver.state.name.lower().replace("_", " "), _SOLVER[solver.state])
        steps = f"{solver.sqp_steps} SQP step" + ("s" if solver.sqp_steps != 1 else "")
        fallbacks = f", {data.fallbacks} fallbacks" if data.fallbacks else ""
        rows.append(("solver", f"{chip} {steps}, {1e3 * solver.feedback_time:.2f} ms{fallbacks}"))
        if solver.active_constraints:
            rows.append(("active", html.escape(", ".join(solver.active_constraints))))
    return rows


def _vehicle_table(data: FlightData, stage: Stage) -> str:
    errors = data.formation_errors()
    leader = stage.vehicles[0]
    rows = []
    for vehicle, colour in zip(stage.vehicles, stage.colours, strict=True):
        error = data.leader_error() if vehicle == leader else errors.get((leader, vehicle))
        others = data.config.targets_of[vehicle]
        seen = sum(data.sees(vehicle, other) for other in others)
        rows.append(
            f'<tr><td><span style="color:{css(colour)}">●</span> {html.escape(vehicle)}'
            f"{_mode(data, vehicle)}</td>"
            f"{_number(error)}{_number(_estimate_error(data, vehicle))}"
            f'<td style="text-align:right;color:{"inherit" if seen == len(others) else _WARNING}">'
            f"{seen} of {len(others)}</td></tr>"
        )
    heads = "".join(
        f'<th style="text-align:{side};font-weight:normal;opacity:0.6">{head}</th>'
        for head, side in zip(
            ("vehicle", "error (m)", "estimate off (m)", "sees"), ("left", *["right"] * 3), strict=True
        )
    )
    return f'<table style="width:100%;margin-top:0.4em"><tr>{heads}</tr>{"".join(rows)}</table>'


def _mode(data: FlightData, vehicle: str) -> str:
    if data.status is None or vehicle not in data.status.vehicle_modes:
        return ""
    mode = data.status.vehicle_modes[vehicle].name.lower().replace("_", " ")
    return f' <span style="opacity:0.6">{mode}</span>'


def _estimate_error(data: FlightData, vehicle: str) -> float | None:
    estimates, truths = data.estimates[vehicle], data.truths[vehicle]
    if not estimates or not truths:
        return None
    newest = estimates.newest
    return float(np.linalg.norm(newest.p_NB_N - truths.at(newest.stamp_ns).p_NB_N))


def _number(value: float | None) -> str:
    style = "text-align:right;font-variant-numeric:tabular-nums"
    if value is None:
        return f'<td style="{style}">–</td>'
    dot = f'<span style="color:{css(of_errors(np.array([value]))[0])}">▪</span>'
    return f'<td style="{style}">{dot} {value:.3f}</td>'


def _table(rows: Sequence[tuple[str, str]]) -> str:
    cells = "".join(
        f'<tr><td style="opacity:0.6;white-space:nowrap;padding-right:0.8em">{name}</td><td>{value}</td></tr>'
        for name, value in rows
    )
    return f'<table style="width:100%">{cells}</table>'


def _chip(text: str, colour: str) -> str:
    return f'<span style="color:{colour};font-weight:600">{html.escape(text)}</span>'
