"""Numbers of a flight around its start, and after the first event of its scenario."""

from dataclasses import dataclass

import numpy as np

from relform_analysis.flight.log import FlightLog
from relform_core.arrays import Array, Mask
from relform_core.units import NANOSECONDS_PER_SECOND, seconds_to_ns

SETTLED = 0.05
"""A formation error below this counts as settled [m], ..."""
SETTLED_FOR = 0.5
"""... if it stays there for this time [s]."""
START = 3.0
"""What counts as the start, from the first control step on [s]."""


@dataclass(frozen=True)
class StartMetrics:
    """The start of a flight."""

    settled_time: float
    """Time from the first control step until the formation error, the mean over the pairs, stays below 0.05 m
    for half a second [s]; NaN: it never does."""
    tilt_max: float
    """Largest tilt in the first 3 s after the first control step [rad]."""


@dataclass(frozen=True)
class EventMetrics:
    """After the start of the first event of the scenario; NaN: it has none, or it was not reached."""

    formation_peak: float
    """Largest formation error of a pair [m]: until the end of the phase in which the event starts, and in the
    steady windows after it. So the steps of the reference in later phases do not count."""
    leader_max: float
    """Largest distance of the leader from its reference position until the end of the flight [m]."""


def start_metrics(log: FlightLog, errors: Array, tilts: Array) -> StartMetrics:
    """Score the start.

    Args:
        errors: formation error of the scored pairs at each control step [m], shape (K, pairs).
        tilts: of all vehicles at each instant of ground truth [rad], shape (T, n).
    """
    if not len(log.phase):
        return StartMetrics(np.nan, np.nan)
    start_ns = int(log.step_ns[0])
    first_ticks = (log.tick_ns >= start_ns) & (log.tick_ns <= start_ns + seconds_to_ns(START))
    times = (log.step_ns - start_ns) / NANOSECONDS_PER_SECOND
    return StartMetrics(settled_time(times, errors.mean(axis=1)), float(tilts[first_ticks].max()))


def settled_time(times: Array, errors: Array) -> float:
    """When the errors first stay below ``SETTLED`` for ``SETTLED_FOR``; NaN: never.

    Args:
        times: of the control steps, increasing [s], shape (K,).
        errors: at these [m], shape (K,).
    """
    since = np.nan
    for time, error in zip(times.tolist(), errors.tolist(), strict=True):
        if not error < SETTLED:
            since = np.nan
        elif np.isnan(since):
            since = time
        if time - since > SETTLED_FOR - 1e-9:  # instants are rounded
            return float(since)
    return np.nan


def event_metrics(log: FlightLog, errors: Array, leader_errors: Array, steady: Mask) -> EventMetrics:
    """Score what follows the first event of the scenario.

    Args:
        errors: formation error of the scored pairs at each control step [m], shape (K, pairs).
        leader_errors: distance of the leader from its reference position [m], shape (K,).
        steady: whether a control step is in a steady window, shape (K,).
    """
    events = log.scenario.config.events
    start_ns = min((seconds_to_ns(event.start) for event in events), default=None)
    if start_ns is None or not (after := log.step_ns >= start_ns).any():
        return EventMetrics(np.nan, np.nan)
    phase = log.phase[int(np.argmax(after))]
    in_its_phase = np.array([name == phase for name in log.phase])
    return EventMetrics(
        float(errors[after & (in_its_phase | steady)].max()), float(leader_errors[after].max())
    )
