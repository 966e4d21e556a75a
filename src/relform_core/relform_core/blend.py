"""Blends from one value to another without a jump of speed."""

import math
from dataclasses import dataclass

import numpy as np

from relform_core.arrays import Array

_PEAK_SPEED = 1.5
"""Largest slope of the smooth step over a unit of time, half-way."""
_PEAK_ACCELERATION = 6.0
"""Largest curvature of the smooth step over a unit of time, at both ends."""
_LONGER = 1.05
"""Factor between durations that are tried one after the other."""


def smooth_step(time: Array, ramp: float) -> Array:
    """From 0 at time 0 to 1 at ``ramp``, without slope at either end; a step where ``ramp`` is 0."""
    x = np.clip(time / ramp, 0.0, 1.0) if ramp > 0.0 else (time >= 0.0).astype(np.float64)
    return x * x * (3.0 - 2.0 * x)


def smooth_step_integral(time: Array, ramp: float) -> Array:
    """Integral of ``smooth_step`` from time 0 on [s]."""
    x = np.clip(time / ramp, 0.0, 1.0) if ramp > 0.0 else np.zeros_like(time)
    return ramp * x**3 * (1.0 - 0.5 * x) + np.maximum(time - ramp, 0.0)


@dataclass(frozen=True, eq=False)
class Blend:
    """Points that move to their targets; they start together, at any velocity, and come to rest together.

    Each coordinate is a cubic in time. Without an initial velocity the paths are straight lines.
    """

    start: Array
    """[m], shape (point, 3)."""
    velocity: Array
    """At the start [m/s], shape (point, 3)."""
    target: Array
    """[m], shape (point, 3)."""
    duration: float
    """[s]; 0: a step."""

    @classmethod
    def at_rest(cls, points: Array) -> "Blend":
        """No motion: points that stay where they are, shape (point, 3)."""
        return cls(points, np.zeros_like(points), points, 0.0)

    @classmethod
    def within(
        cls, start: Array, velocity: Array, target: Array, speed_max: float, acceleration_max: float
    ) -> "Blend":
        """The shortest blend within bounds, which hold for every point.

        A point that is faster than ``speed_max`` at the start gets no faster.

        Args:
            start: [m], shape (point, 3).
            velocity: at the start [m/s], shape (point, 3).
            target: [m], shape (point, 3).
            speed_max: [m/s].
            acceleration_max: [m/s^2].
        """
        distance = _longest(target - start)
        duration = max(
            _PEAK_SPEED * distance / speed_max, math.sqrt(_PEAK_ACCELERATION * distance / acceleration_max)
        )
        if not velocity.any():
            return cls(start, velocity, target, duration)
        fastest = max(speed_max, _longest(velocity))
        blend = cls(start, velocity, target, max(duration, _longest(velocity) / acceleration_max))
        while blend._peak_speed() > fastest * 1.001 or blend._peak_acceleration() > acceleration_max:
            blend = cls(start, velocity, target, blend.duration * _LONGER)
        return blend

    @property
    def straight(self) -> bool:
        """Whether all points move along straight lines."""
        return self.duration == 0.0 or not self.velocity.any()

    def at(self, elapsed: Array) -> Array:
        """Points at times since the start [s], shape (instant,): [m], shape (point, instant, 3)."""
        share = smooth_step(elapsed, self.duration)[:, None]
        points: Array = self.start[:, None] + (self.target - self.start)[:, None] * share
        if not self.straight:
            x = np.clip(elapsed / self.duration, 0.0, 1.0)[:, None]
            points += self.velocity[:, None] * (self.duration * x * (1.0 - x) ** 2)
        return points

    def velocity_at(self, elapsed: float) -> Array:
        """Velocities at a time since the start [s]: [m/s], shape (point, 3)."""
        if elapsed >= self.duration:
            return np.zeros_like(self.start)
        x = elapsed / self.duration
        mean = (self.target - self.start) / self.duration
        return mean * (6.0 * x * (1.0 - x)) + self.velocity * ((1.0 - x) * (1.0 - 3.0 * x))

    def _peak_speed(self) -> float:
        times = np.linspace(0.0, self.duration, 41)[:-1]
        return max(_longest(self.velocity_at(float(time))) for time in times)

    def _peak_acceleration(self) -> float:
        """Acceleration is linear in time: it peaks at one of the ends."""
        mean = (self.target - self.start) / self.duration
        at_start = (6.0 * mean - 4.0 * self.velocity) / self.duration
        at_end = (-6.0 * mean + 2.0 * self.velocity) / self.duration
        return max(_longest(at_start), _longest(at_end))


def _longest(vectors: Array) -> float:
    return float(np.linalg.norm(vectors, axis=1).max())
