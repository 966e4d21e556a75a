"""The plots over time of what the estimator did: its errors beside what it thinks of them."""

from collections.abc import Sequence

import numpy as np

from relform_analysis.flight.estimation_errors import (
    EstimationErrors,
    leader_estimation_errors,
    nis_bounds,
    pair_estimation_errors,
)
from relform_analysis.flight.log import FlightLog
from relform_analysis.flight.tracking_errors import scored_pairs
from relform_analysis.plots.palette import Style, series_style, vehicle_style
from relform_analysis.plots.panels import Guide, Line, Panel, pair_label, scored_pair_styles
from relform_core.arrays import Array
from relform_core.names import EstimatorMode

AXES = ("x", "y", "z")
SIGMAS = 2.0
PAIRS_IN_DETAIL = 7
"""Up to this number each has a plot of x, y and z."""
MODES = ", ".join(f"{mode.value} {mode.name.lower()}" for mode in EstimatorMode)


def estimation_panels(log: FlightLog) -> list[Panel]:
    """Errors of pairs and leader with bands of two standard deviations, NIS, and rejected measurements.

    With many pairs their position errors share one plot, without bands.

    Empty for a flight of an older version, which has no estimate of the leader.
    """
    if not np.isfinite(log.estimator["mode"]).any():
        return []
    pairs = scored_pairs(log.scenario.config.team)
    between, leader = pair_estimation_errors(log), leader_estimation_errors(log)
    names = [pair_label(*pair) for pair in pairs]
    yaws = [
        _angle(name, style, between.errors[:, index, 3], between.deviations[:, index, 3])
        for index, (name, style) in enumerate(zip(names, scored_pair_styles(log), strict=True))
    ]
    leader_yaw = _angle("yaw", vehicle_style(log.leader), leader.errors[:, 3], leader.deviations[:, 3])
    return [
        *_positions(log, names, between),
        _errors("relative yaw", "deg", 2, yaws),
        _position(log.vehicles[log.leader], leader),
        _errors(f"yaw of {log.vehicles[log.leader]}", "deg", 2, [leader_yaw]),
        *_innovations(log),
        Panel(
            f"Estimator: mode ({MODES})",
            "",
            0,
            [Line("mode", series_style(0), log.estimator["mode"])],
            steps=True,
        ),
        Panel(
            "Estimator: rejected measurements per step",
            "",
            0,
            [Line("rejected", series_style(1), log.estimator["rejected"])],
            steps=True,
        ),
    ]


def _positions(log: FlightLog, names: Sequence[str], between: EstimationErrors) -> list[Panel]:
    if len(names) <= PAIRS_IN_DETAIL:
        return [
            _position(name, EstimationErrors(between.errors[:, index], between.covariances[:, index]))
            for index, name in enumerate(names)
        ]
    distances = 1e3 * np.linalg.norm(between.errors[..., :3], axis=-1)
    lines = [
        Line(name, style, distance)
        for name, style, distance in zip(names, scored_pair_styles(log), distances.T, strict=True)
    ]
    return [Panel("Estimate − truth: distance of the positions", "mm", 1, lines)]


def _position(name: str, estimate: EstimationErrors) -> Panel:
    millimetres, deviations = 1e3 * estimate.errors, 1e3 * estimate.deviations
    lines = [
        Line(axis, series_style(index), millimetres[:, index], _band(deviations[:, index]))
        for index, axis in enumerate(AXES)
    ]
    return _errors(name, "mm", 1, lines)


def _errors(name: str, unit: str, digits: int, lines: Sequence[Line]) -> Panel:
    bands = ", 2σ" if any(line.high is not None for line in lines) else ""
    return Panel(f"Estimate − truth: {name}{bands}", unit, digits, lines)


def _angle(name: str, style: Style, error: Array, deviation: Array) -> Line:
    return Line(name, style, np.degrees(error), _band(np.degrees(deviation)))


def _band(deviation: Array) -> Array | None:
    """None where no covariance is known, as with raw feedback."""
    return SIGMAS * deviation if np.isfinite(deviation).any() else None


def _innovations(log: FlightLog) -> list[Panel]:
    nis, dof = log.estimator["nis"], log.estimator["nis_dof"]
    if not np.isfinite(nis).any():
        return []
    low, high = nis_bounds(dof)
    return [
        Panel(
            "NIS of range and bearing per degree of freedom",
            "",
            2,
            [
                Line("NIS", series_style(0), nis / np.where(dof > 0.0, dof, np.nan)),
                Line("2.5 %", series_style(1), low / dof),
                Line("97.5 %", series_style(1), high / dof),
            ],
            [Guide("expected 1", (1.0,))],
        )
    ]
