"""The leader's reference: the phases of a scenario as a smooth path with position, velocity and yaw.

Horizontal speed, climb and turn rate blend from one phase into the next, except that a turn has a turn rate
of its own, from zero to zero, and that paths (circle, figure eight, waypoints, recorded ones) start and end
at rest. The yaw is the integral of the turn rate, the position that of the velocity. The heading is the yaw,
except that a recorded path may fly sideways too.
"""

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from relform_controller.reference.paths import circle, figure_eight, recorded, waypoints
from relform_core.arrays import Array, Integers
from relform_core.blend import smooth_step
from relform_core.paths_config import Circle, FigureEight, Waypoints
from relform_core.phases_config import Hover, Motion, Spiral, Straight, Turn
from relform_core.recorded_path_config import RecordedPath
from relform_core.scenario_config import ScenarioConfig
from relform_core.units import NANOSECONDS_PER_SECOND

_SAMPLES = 8
"""Samples per control period that are kept; between them the reference is interpolated linearly."""
_SUBSTEPS = 5 * _SAMPLES
"""Integration steps per control period."""


@dataclass(frozen=True, eq=False)
class LeaderReference:
    """Reference of the leader at consecutive instants."""

    p_NB_N: Array
    """[m], shape (instant, 3)."""
    v_NB_N: Array
    """[m/s], shape (instant, 3)."""
    yaw_NB: Array
    """Continuous, not wrapped [rad], shape (instant,)."""


class LeaderTrajectory:
    """Reference of the leader during a flight; the motion of the last phase continues after the end.

    Args:
        config: the scenario.
        n_extra: control periods after the end for which there is a reference too, normally the horizon.
    """

    def __init__(self, config: ScenarioConfig, n_extra: int) -> None:
        self._period_ns = config.period_ns
        n_instants = round(config.duration / config.controller.period) + 1 + n_extra
        step = config.controller.period / _SUBSTEPS
        time = np.linspace(0.0, (n_instants - 1) * config.controller.period, (n_instants - 1) * _SUBSTEPS + 1)
        ahead, climb, turn_rate, left = _profiles(config, time)
        yaw_NB = config.start.yaw + _integral(turn_rate, step)
        cosine, sine = np.cos(yaw_NB), np.sin(yaw_NB)
        v_NB_N = np.stack([ahead * cosine - left * sine, ahead * sine + left * cosine, climb], axis=-1)
        p_NB_N = np.array(config.start.position) + _integral(v_NB_N, step)
        every = slice(None, None, _SUBSTEPS // _SAMPLES)
        self._samples = np.concatenate([p_NB_N[every], v_NB_N[every], yaw_NB[every, None]], axis=1)
        """p_NB_N, v_NB_N, yaw_NB, shape (sample, 7)."""

    @property
    def last_ns(self) -> int:
        """Last instant since the start of the flight with a reference [ns]."""
        return (len(self._samples) - 1) // _SAMPLES * self._period_ns

    def at(self, stamps_ns: Integers) -> LeaderReference:
        """The reference at instants since the start of the flight [ns], shape (instant,).

        Raises:
            ValueError: an instant before the start, or after the last one with a reference.
        """
        position = stamps_ns / self._period_ns * _SAMPLES
        last = len(self._samples) - 1
        if position.min() < 0 or position.max() > last:
            end = self.last_ns / NANOSECONDS_PER_SECOND
            shown = ", ".join(f"{stamp / NANOSECONDS_PER_SECOND:g}" for stamp in stamps_ns[[0, -1]])
            raise ValueError(f"the leader's reference is known from 0 to {end:g} s (asked for {shown} s)")
        before = np.floor(position).astype(np.int64)
        after = np.minimum(before + 1, last)
        earlier = self._samples[before]
        found = earlier + (self._samples[after] - earlier) * (position - before)[:, None]
        return LeaderReference(found[:, 0:3], found[:, 3:6], found[:, 6])

    def lowest(self, first_ns: int, last_ns: int) -> float:
        """Smallest height between two instants since the start of the flight [ns]: [m]."""
        first, last = (stamp_ns * _SAMPLES // self._period_ns for stamp_ns in (first_ns, last_ns))
        return float(self._samples[first : last + 1, 2].min())


class SampledReference:
    """A reference of one's own, asked by instants as a ``LeaderTrajectory`` is.

    Args:
        reference: of the leader at times since the start of the flight [s], shape (instant,).
        period_ns: control period [ns].
    """

    def __init__(self, reference: Callable[[Array], LeaderReference], period_ns: int) -> None:
        self._reference = reference
        self._period_ns = period_ns

    def at(self, stamps_ns: Integers) -> LeaderReference:
        """The reference at instants since the start of the flight [ns], shape (instant,)."""
        return self._reference(stamps_ns / NANOSECONDS_PER_SECOND)

    def lowest(self, first_ns: int, last_ns: int) -> float:
        """Smallest height at control steps between two instants since the start of the flight [ns]: [m]."""
        heights = self.at(np.arange(first_ns, last_ns + 1, self._period_ns)).p_NB_N[:, 2]
        return float(heights.min())


def _profiles(config: ScenarioConfig, time: Array) -> Array:
    """Speed ahead [m/s], climb [m/s], turn rate [rad/s] and speed to the left [m/s] at ``time`` [s], shape
    (4, time)."""
    profiles = np.zeros((4, time.size))
    steps = [*config.phase_starts, time.size]  # the last phase goes on until the end
    for phase, start, (step, next_step) in zip(
        config.phases, config.phase_start_times, itertools.pairwise(steps), strict=True
    ):
        begin, end = step * _SUBSTEPS, next_step * _SUBSTEPS + 1
        entry = profiles[:, begin]  # where the phase before ends
        profiles[:, begin:end] = _phase_profile(phase.motion, time[begin:end] - start, entry)
    return profiles


def _phase_profile(motion: Motion, time: Array, entry: Array) -> Array:
    """The profile from the start of a phase on, shape (4, time)."""
    match motion:
        case Hover():
            return _blend(entry, np.zeros(4), time, motion.ramp)
        case Straight():
            return _blend(entry, np.array([motion.speed, 0.0, 0.0, 0.0]), time, motion.ramp)
        case Spiral():
            speed = math.sqrt(motion.speed**2 - motion.climb**2)
            target = np.array([speed, motion.climb, speed / motion.radius, 0.0])
            return _blend(entry, target, time, motion.ramp)
        case Turn():
            x = np.clip(time / motion.turn, 0.0, 1.0)
            profile = np.repeat(entry[:, None], time.size, axis=1)
            profile[2] = motion.angle * 6.0 * x * (1.0 - x) / motion.turn  # derivative of the smooth step
            return profile
        case Circle():
            return circle(motion, time)
        case FigureEight():
            return figure_eight(motion, time)
        case Waypoints():
            return waypoints(motion, time)
        case RecordedPath():
            return recorded(motion, time)


def _blend(entry: Array, target: Array, time: Array, ramp: float) -> Array:
    return entry[:, None] + (target - entry)[:, None] * smooth_step(time, ramp)


def _integral(rate: Array, step: float) -> Array:
    """Integral from the first sample on, by the trapezoidal rule along the first axis."""
    integral = np.zeros_like(rate)
    np.cumsum((rate[:-1] + rate[1:]) * (step / 2.0), axis=0, out=integral[1:])
    return integral
