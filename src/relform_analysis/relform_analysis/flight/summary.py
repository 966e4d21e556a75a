"""summary.json of a flight (docs/summary.md). Here the numbers leave SI: every key ends in its unit."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any

from relform_analysis.flight.metrics import Distribution, Errors, FlightMetrics, PhaseMetrics, Score
from relform_analysis.flight.real_time import Ages, RealTimeMetrics
from relform_core.atomic_file import write_json_atomically
from relform_core.load import LoadedScenario
from relform_core.units import rad_s_to_rpm

FORMAT_VERSION = 1

Json = dict[str, Any]


class Outcome(StrEnum):
    """How a flight ended."""

    COMPLETED = "completed"
    FAULT = "fault"
    """A vehicle reported a fault: collision, ground contact, too much tilt."""
    INTERRUPTED = "interrupted"
    """The user ended it."""
    FAILED = "failed"
    """A node died, fell silent or could not continue."""


@dataclass(frozen=True)
class Ending:
    """How and when a flight ended."""

    outcome: Outcome
    reason: str | None
    """One line; None for a completed flight."""
    wall_time: float
    """Time that the flight took, without start-up and evaluation [s]."""
    flown: float
    """Simulation time [s]."""


def build_summary(
    scenario: LoadedScenario, metrics: FlightMetrics, ending: Ending, versions: Mapping[str, str | None]
) -> Json:
    """Content of summary.json; numbers that the flight was too short for are None."""
    config, score, rotors, solver = scenario.config, metrics.score, metrics.rotors, metrics.solver
    formation = _errors(score.formation, "m")
    summary = {
        "format": FORMAT_VERSION,
        "scenario": config.name,
        "title": config.title,
        "seed": scenario.seed,
        "vehicles": list(config.team.vehicles),
        "outcome": ending.outcome.value,
        "reason": ending.reason,
        "steps": metrics.steps,
        "steps_planned": config.n_steps,
        "flown_s": ending.flown,
        "wall_s": ending.wall_time,
        "realtime_factor": ending.flown / ending.wall_time if ending.wall_time > 0.0 else None,
        "peak_m": formation.pop("max_m"),
        **formation,
        **_errors(score.leader_position, "m", "leader_"),
        **_errors(score.leader_yaw, "deg", "leader_yaw_"),
        **_errors(score.follower_yaw, "deg", "follower_yaw_"),
        "rotor_min_rpm": rad_s_to_rpm(rotors.min),
        "rotor_max_rpm": rad_s_to_rpm(rotors.max),
        "rotor_mean_rpm": rad_s_to_rpm(rotors.mean),
        "rotor_std_rpm": rad_s_to_rpm(rotors.std),
        "saturated_fraction": rotors.saturated_fraction,
        "separation_min_m": metrics.separation_min,
        "tilt_max_deg": math.degrees(metrics.tilt_max),
        "view_margin_min_deg": math.degrees(metrics.view_margin_min),
        "sqp_steps_median": solver.sqp_steps_median,
        "kkt_first_median": solver.kkt_first_median,
        "kkt_median": solver.kkt_median,
        "prepare_ms_median": 1e3 * solver.prepare_time_median,
        "feedback_ms_median": 1e3 * solver.feedback_time_median,
        "step_ms_median": 1e3 * solver.step_time_median,
        "step_ms_max": 1e3 * solver.step_time_max,
        "fallback_steps": solver.fallback_steps,
        "constraints_active_s": dict(solver.active_times),
        "start_settled_s": metrics.start.settled_time,
        "start_tilt_max_deg": math.degrees(metrics.start.tilt_max),
        "event_peak_m": metrics.event.formation_peak,
        "event_leader_max_m": metrics.event.leader_max,
        "position_nees": metrics.consistency.position_nees,
        "yaw_nees": metrics.consistency.yaw_nees,
        "leader_nees": metrics.consistency.leader_nees,
        "nis_inside_fraction": metrics.consistency.nis_inside,
        "pairs": _pairs(score),
        "phases": [_phase(phase) for phase in metrics.phases],
        "real_time": None if metrics.real_time is None else _real_time(metrics.real_time),
        "versions": dict(versions),
    }
    return {key: _without_nan(value) for key, value in summary.items()}


def write_summary(path: Path | str, summary: Json) -> None:
    """Write summary.json atomically.

    Raises:
        RelformError: it cannot be written.
    """
    write_json_atomically(path, summary)


def _phase(phase: PhaseMetrics) -> Json:
    return {
        "name": phase.name,
        "title": phase.title,
        "start_s": phase.start,
        "settling_s": phase.settling_time,
        "steps": phase.steps,
        **_errors(phase.score.formation, "m"),
        **_errors(phase.score.leader_position, "m", "leader_"),
        **_errors(phase.score.leader_yaw, "deg", "leader_yaw_"),
        **_errors(phase.score.follower_yaw, "deg", "follower_yaw_"),
        "pairs": _pairs(phase.score),
    }


def _real_time(metrics: RealTimeMetrics) -> Json:
    return {
        "missed_steps": dict(metrics.missed_steps),
        "held_s": metrics.held,
        **_ages(metrics.measurements, "measurement"),
        **_ages(metrics.commands, "command"),
    }


def _ages(ages: Ages | None, what: str) -> dict[str, float]:
    values = (math.nan,) * 3 if ages is None else (ages.median, ages.percentile_99, ages.most)
    names = ("age_median_ms", "age_p99_ms", "age_max_ms")
    return {f"{what}_{name}": value for name, value in zip(names, values, strict=True)}


def _pairs(score: Score) -> list[Json]:
    return [
        {"observer": observer, "target": target, **_errors(errors, "m")}
        for (observer, target), errors in score.pairs.items()
    ]


def _errors(errors: Errors, unit: str, prefix: str = "") -> dict[str, float]:
    return {
        **_distribution(errors.all, unit, prefix),
        **_distribution(errors.steady, unit, f"{prefix}steady_"),
    }


def _distribution(distribution: Distribution, unit: str, prefix: str) -> dict[str, float]:
    factor = math.degrees(1.0) if unit == "deg" else 1.0
    return {
        f"{prefix}mean_{unit}": factor * distribution.mean,
        f"{prefix}p95_{unit}": factor * distribution.p95,
        f"{prefix}max_{unit}": factor * distribution.max,
    }


def _without_nan(value: Any) -> Any:
    """NaN and infinity, which JSON does not have, as None."""
    match value:
        case dict():
            return {key: _without_nan(each) for key, each in value.items()}
        case list():
            return [_without_nan(each) for each in value]
        case float() if not math.isfinite(value):
            return None
        case _:
            return value
