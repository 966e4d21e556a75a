"""The numbers that relform reports of a flight, each defined once, from ground truth.

Lengths in metres, angles in radians, speeds in rad/s, times in seconds. A number is NaN if
the flight ended too early for it or its topic was not recorded.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from relform_analysis.flight.estimation_errors import Consistency
from relform_analysis.flight.log import FlightLog
from relform_analysis.flight.real_time import RealTimeMetrics, real_time_metrics
from relform_analysis.flight.special_metrics import (
    EventMetrics,
    StartMetrics,
    event_metrics,
    start_metrics,
)
from relform_analysis.flight.tracking_errors import (
    follower_yaw_errors,
    formation_errors,
    leader_errors,
    scored_pairs,
)
from relform_analysis.flight.view_margins import view_margins
from relform_core.arrays import Array, Mask
from relform_core.names import SolverState
from relform_core.phases_config import PhaseConfig
from relform_core.units import NANOSECONDS_PER_SECOND, rpm_to_rad_s, seconds_to_ns

AT_LIMIT = rpm_to_rad_s(1.0)
"""A rotor whose commanded speed is this close to a limit counts as saturated [rad/s]."""


@dataclass(frozen=True)
class Distribution:
    """Distribution of an error that is never negative."""

    mean: float
    p95: float
    max: float

    @classmethod
    def of(cls, errors: Array) -> Self:
        """Over all values that are finite; NaN if there is none."""
        finite = errors[np.isfinite(errors)]
        if finite.size == 0:
            return cls(np.nan, np.nan, np.nan)
        return cls(float(finite.mean()), float(np.percentile(finite, 95.0)), float(finite.max()))


@dataclass(frozen=True)
class Errors:
    """An error over some stretch of the flight."""

    all: Distribution
    steady: Distribution
    """In the steady windows only."""

    @classmethod
    def of(cls, errors: Array, steps: Mask, steady: Mask) -> Self:
        """Over the control steps ``steps``; the errors have the shape (K, ...)."""
        return cls(Distribution.of(errors[steps]), Distribution.of(errors[steps & steady]))


@dataclass(frozen=True)
class Score:
    """Errors over some stretch of the flight."""

    pairs: Mapping[tuple[str, str], Errors]
    """Formation error by (observer, target)."""
    formation: Errors
    """Formation error of all these pairs together."""
    leader_position: Errors
    leader_yaw: Errors
    follower_yaw: Errors
    """Of all followers, relative to the leader."""


@dataclass(frozen=True)
class PhaseMetrics:
    """One phase of the flight."""

    name: str
    title: str
    steps: int
    start: float
    """First control instant of the phase [s]; NaN: never reached."""
    settling_time: float
    """Time from there until the formation error, the mean over the pairs, is no longer larger than it ever
    is in the steady window [s]; NaN: that was never reached."""
    score: Score


@dataclass(frozen=True)
class RotorMetrics:
    """Commanded rotor speeds, over all vehicles, rotors and control steps."""

    min: float
    max: float
    mean: float
    std: float
    saturated_fraction: float
    """Share of the control steps in which some rotor was commanded to within 1 rpm of a limit."""


@dataclass(frozen=True)
class SolverMetrics:
    """Steps, values and times of the solver per control step."""

    sqp_steps_median: float
    kkt_first_median: float
    kkt_median: float
    prepare_time_median: float
    feedback_time_median: float
    step_time_median: float
    """Preparation and feedback together [s]."""
    step_time_max: float
    fallback_steps: int
    """Control steps that flew the plan before, because an SQP step failed."""
    active_times: Mapping[str, float]
    """For how long each soft constraint was active in the plan, of those that ever were [s]."""


@dataclass(frozen=True)
class FlightMetrics:
    """A whole flight."""

    steps: int
    score: Score
    phases: tuple[PhaseMetrics, ...]
    rotors: RotorMetrics
    separation_min: float
    """Smallest distance between the centres of two vehicles at any instant of ground truth [m]."""
    tilt_max: float
    """Largest angle between body z of a vehicle and the vertical at any instant [rad]."""
    view_margin_min: float
    """Smallest angle by which a vehicle was inside the field of view of another at any instant [rad]."""
    solver: SolverMetrics
    start: StartMetrics
    event: EventMetrics
    consistency: Consistency
    real_time: RealTimeMetrics | None
    """None: the flight was in lock-step."""


def flight_metrics(log: FlightLog) -> FlightMetrics:
    """Score a flight."""
    pairs = scored_pairs(log.scenario.config.team)
    errors = formation_errors(log, pairs)
    position_errors, yaw_errors = leader_errors(log)
    follower_yaw = follower_yaw_errors(log)
    steady, tilted = steady_steps(log), tilts(log.q_NB)

    def score(steps: Mask) -> Score:
        return Score(
            pairs={
                pair: Errors.of(error, steps, steady) for pair, error in zip(pairs, errors.T, strict=True)
            },
            formation=Errors.of(errors, steps, steady),
            leader_position=Errors.of(position_errors, steps, steady),
            leader_yaw=Errors.of(yaw_errors, steps, steady),
            follower_yaw=Errors.of(follower_yaw, steps, steady),
        )

    def score_phase(phase: PhaseConfig) -> PhaseMetrics:
        steps = phase_steps(log, phase)
        times = log.step_ns[steps] / NANOSECONDS_PER_SECOND
        return PhaseMetrics(
            name=phase.name,
            title=phase.title,
            steps=len(times),
            start=float(times[0]) if len(times) else np.nan,
            settling_time=settling_time(times, errors[steps].mean(axis=1), steady[steps]),
            score=score(steps),
        )

    return FlightMetrics(
        steps=len(log.phase),
        score=score(np.ones(len(log.phase), dtype=np.bool_)),
        phases=tuple(score_phase(phase) for phase in log.scenario.config.phases),
        rotors=_rotor_metrics(log),
        separation_min=separation_min(log.p_NB_N),
        tilt_max=_over(tilted, np.max),
        view_margin_min=_least(view_margins(log)),
        solver=_solver_metrics(log),
        real_time=real_time_metrics(log),
        start=start_metrics(log, errors, tilted),
        event=event_metrics(log, errors, position_errors, steady),
        consistency=Consistency.of(log, steady),
    )


def tilts(q_NB: Array) -> Array:
    """Angle between body z and the vertical [rad]; ``q_NB`` is (x, y, z, w), shape (..., 4)."""
    x, y, z, w = np.moveaxis(q_NB, -1, 0)
    return np.asarray(2.0 * np.arctan2(np.hypot(x, y), np.hypot(z, w)))


def steady_steps(log: FlightLog) -> Mask:
    """Whether a control step is in its phase's steady window, ``steady_from`` after its begin; shape (K,).

    Steps before the mission starts are in none.
    """
    config = log.scenario.config
    margin_ns = config.period_ns // 2  # a window may begin on an instant, which is rounded
    if config.ground is not None:
        since_ns = {phase.name: seconds_to_ns(phase.steady_from) - margin_ns for phase in config.phases}
        steps = zip(log.phase, log.step_ns.tolist(), _phase_begins_ns(log), strict=True)
        return np.array(
            [name in since_ns and now_ns - begin_ns >= since_ns[name] for name, now_ns, begin_ns in steps],
            dtype=np.bool_,
        )
    begin_ns = [
        start * config.period_ns + seconds_to_ns(phase.steady_from) - margin_ns
        for start, phase in zip(config.phase_starts, config.phases, strict=True)
    ]
    mission_ns = log.step_ns - mission_start_ns(log)
    index = [config.phase_index(max(step, 0)) for step in (mission_ns // config.period_ns).tolist()]
    return np.asarray(mission_ns >= np.array(begin_ns, dtype=np.int64)[index])


def _phase_begins_ns(log: FlightLog) -> list[int]:
    """At each step, the instant at which what the team does then began [ns]."""
    begins_ns: list[int] = []
    for index, stamp_ns in enumerate(log.step_ns.tolist()):
        is_same = index > 0 and log.phase[index] == log.phase[index - 1]
        begins_ns.append(begins_ns[-1] if is_same else stamp_ns)
    return begins_ns


def mission_start_ns(log: FlightLog) -> int:
    """Instant at which the mission starts, from the first change of phase between consecutive steps [ns].

    It is 0 unless the controller had to wait, or held the team where it was.
    """
    config = log.scenario.config
    for index in range(1, len(log.phase)):
        stamp_ns = int(log.step_ns[index])
        is_next = stamp_ns - log.step_ns[index - 1] == config.period_ns
        if is_next and log.phase[index] != log.phase[index - 1]:
            names = [phase.name for phase in config.phases]
            return stamp_ns - config.phase_starts[names.index(log.phase[index])] * config.period_ns
    return 0


def phase_steps(log: FlightLog, phase: PhaseConfig) -> Mask:
    """Whether a control step belongs to a phase, shape (K,)."""
    return np.array([name == phase.name for name in log.phase], dtype=np.bool_)


def settling_time(times: Array, errors: Array, steady: Mask) -> float:
    """Time from the first step until the error is no longer larger than it ever is in the steady window [s].

    Args:
        times: instants of the steps of one phase [s], shape (K,).
        errors: at these, shape (K,).
        steady: whether they are in the steady window, shape (K,).
    Returns:
        NaN if there is no steady window, or if the error is larger to the end: the flight ended after it.
    """
    if not steady.any():
        return np.nan
    larger = np.flatnonzero(errors > errors[steady].max())
    settled = larger[-1] + 1 if larger.size else 0
    return float(times[settled] - times[0]) if settled < len(times) else np.nan


def separation_min(p_NB_N: Array) -> float:
    """Smallest distance between two vehicles at any instant [m]; ``p_NB_N`` has the shape (T, n, 3)."""
    return _over(separations(p_NB_N), np.min)


def separations(p_NB_N: Array) -> Array:
    """Smallest distance between two vehicles at each instant [m], shape (T,)."""
    first, second = np.triu_indices(p_NB_N.shape[1], k=1)
    smallest: Array = np.linalg.norm(p_NB_N[:, first] - p_NB_N[:, second], axis=-1).min(axis=1)
    return smallest


def _rotor_metrics(log: FlightLog) -> RotorMetrics:
    speeds = log.rotor_speeds[np.isfinite(log.rotor_speeds).all(axis=(1, 2))]
    vehicle = log.scenario.config.vehicle
    low, high = vehicle.rotor_speed_min + AT_LIMIT, vehicle.rotor_speed_max - AT_LIMIT
    saturated = np.asarray(((speeds <= low) | (speeds >= high)).any(axis=(1, 2)))
    return RotorMetrics(
        min=_over(speeds, np.min),
        max=_over(speeds, np.max),
        mean=_over(speeds, np.mean),
        std=_over(speeds, np.std),
        saturated_fraction=_over(saturated, np.mean),
    )


def _solver_metrics(log: FlightLog) -> SolverMetrics:
    solver = {name: values[np.isfinite(values)] for name, values in log.solver.items()}
    step_time = solver["prepare_time"] + solver["feedback_time"]
    return SolverMetrics(
        sqp_steps_median=_over(solver["sqp_steps"], np.median),
        kkt_first_median=_over(solver["kkt_first"], np.median),
        kkt_median=_over(solver["kkt"], np.median),
        prepare_time_median=_over(solver["prepare_time"], np.median),
        feedback_time_median=_over(solver["feedback_time"], np.median),
        step_time_median=_over(step_time, np.median),
        step_time_max=_over(step_time, np.max),
        fallback_steps=int((solver["status"] == SolverState.FALLBACK).sum()),
        active_times={
            name: int(active.sum()) * log.scenario.config.period_ns / NANOSECONDS_PER_SECOND
            for name, active in log.active_constraints.items()
        },
    )


def _least(values: Array) -> float:
    return _over(values[np.isfinite(values)], np.min)


def _over(values: npt.NDArray[Any], statistic: Callable[[npt.NDArray[Any]], Any]) -> float:
    return float(statistic(values)) if values.size else np.nan
