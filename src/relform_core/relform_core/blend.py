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
_SAMPLES, _DETOUR_SAMPLES = 41, 161
"""Number of instants at which a speed is checked, without and with detours."""
N_DETOURS = 3
"""Number of control points of a detour."""


def smooth_step(time: Array, ramp: float) -> Array:
    """From 0 at time 0 to 1 at ``ramp``, without slope at either end; a step where ``ramp`` is 0."""
    x = np.clip(time / ramp, 0.0, 1.0) if ramp > 0.0 else (time >= 0.0).astype(np.float64)
    return x * x * (3.0 - 2.0 * x)


def smooth_step_integral(time: Array, ramp: float) -> Array:
    """Integral of ``smooth_step`` from time 0 on [s]."""
    x = np.clip(time / ramp, 0.0, 1.0) if ramp > 0.0 else np.zeros_like(time)
    return ramp * x**3 * (1.0 - 0.5 * x) + np.maximum(time - ramp, 0.0)


def detour_weights(share: Array) -> tuple[Array, Array, Array]:
    """How far the control points of a detour draw a point aside, at shares of its way, shape (instant,).

    They are the inner Bernstein polynomials of degree 4, and their first and second derivatives, each of
    shape (control point, instant).
    """
    w, left = share, 1.0 - share
    value = [4.0 * w * left**3, 6.0 * (w * left) ** 2, 4.0 * w**3 * left]
    first = [4.0 * left**2 * (1.0 - 4.0 * w), 12.0 * w * left * (1.0 - 2.0 * w), 4.0 * w**2 * (3.0 - 4.0 * w)]
    second = [-24.0 * left * (1.0 - 2.0 * w), 12.0 * (1.0 - 6.0 * w * left), 24.0 * w * (1.0 - 2.0 * w)]
    return np.array(value), np.array(first), np.array(second)


@dataclass(frozen=True, eq=False)
class Blend:
    """Points that move to their targets; they start together, at any velocity, and come to rest together.

    Each coordinate is a cubic in time, plus a detour. Without an initial velocity and without a detour the
    paths are straight lines.
    """

    start: Array
    """[m], shape (point, 3)."""
    velocity: Array
    """At the start [m/s], shape (point, 3)."""
    target: Array
    """[m], shape (point, 3)."""
    duration: float
    """[s]; 0: a step."""
    detours: Array | None = None
    """Control points, relative to the straight way [m], shape (point, control point, 3)."""

    @classmethod
    def at_rest(cls, points: Array) -> "Blend":
        """No motion: points that stay where they are, shape (point, 3)."""
        return cls(points, np.zeros_like(points), points, 0.0)

    @classmethod
    def within(
        cls,
        start: Array,
        velocity: Array,
        target: Array,
        speed_max: float,
        acceleration_max: float,
        detours: Array | None = None,
        duration_min: float = 0.0,
    ) -> "Blend":
        """The shortest blend within bounds, which hold for every point.

        A point that is faster than ``speed_max`` at the start gets no faster.

        Args:
            start: [m], shape (point, 3).
            velocity: at the start [m/s], shape (point, 3).
            target: [m], shape (point, 3).
            speed_max: [m/s].
            acceleration_max: [m/s^2].
            detours: [m], shape (point, control point, 3).
            duration_min: it takes at least this time [s].
        """
        distance = _longest(target - start)
        duration = max(
            _PEAK_SPEED * distance / speed_max,
            math.sqrt(_PEAK_ACCELERATION * distance / acceleration_max),
            duration_min,
        )
        if not velocity.any() and detours is None:
            return cls(start, velocity, target, duration)
        fastest = max(speed_max, _longest(velocity))
        duration = max(duration, _longest(velocity) / acceleration_max)
        blend = cls(start, velocity, target, duration, detours)
        while blend._peak_speed() > fastest * 1.001 or _longest(blend.accelerations()) > acceleration_max:
            blend = cls(start, velocity, target, blend.duration * _LONGER, detours)
        return blend

    @property
    def straight(self) -> bool:
        """Whether all points move along straight lines."""
        return self.duration == 0.0 or (not self.velocity.any() and self.detours is None)

    def at(self, elapsed: Array) -> Array:
        """Points at times since the start [s], shape (instant,): [m], shape (point, instant, 3)."""
        share = smooth_step(elapsed, self.duration)[:, None]
        points: Array = self.start[:, None] + (self.target - self.start)[:, None] * share
        if not self.straight:
            x = np.clip(elapsed / self.duration, 0.0, 1.0)[:, None]
            points += self.velocity[:, None] * (self.duration * x * (1.0 - x) ** 2)
        if self.detours is not None:
            points += _drawn_aside(self.detours, detour_weights(share[:, 0])[0])
        return points

    def velocity_at(self, elapsed: Array) -> Array:
        """Velocities at times since the start [s], shape (instant,): [m/s], shape (point, instant, 3)."""
        velocity = np.zeros((len(self.start), len(elapsed), 3))
        moves = elapsed < self.duration
        if moves.any():
            velocity[:, moves] = self._velocity(elapsed[moves] / self.duration)
        return velocity

    def accelerations(self) -> Array:
        """At instants with the largest one among them [m/s^2], shape (point, instant, 3).

        Without detours the acceleration is linear in time, so these instants are the ends.
        """
        n_samples = 2 if self.detours is None else _DETOUR_SAMPLES
        return self._acceleration(np.linspace(0.0, 1.0, n_samples))

    def _peak_speed(self) -> float:
        n_samples = _SAMPLES if self.detours is None else _DETOUR_SAMPLES
        times = np.linspace(0.0, self.duration, n_samples)[:-1]
        return _longest(self._velocity(times / self.duration))

    def _velocity(self, x: Array) -> Array:
        """Velocities at shares of the time, shape (instant,): [m/s], shape (point, instant, 3)."""
        mean = ((self.target - self.start) / self.duration)[:, None]
        slope, x = 6.0 * x * (1.0 - x), x[:, None]
        velocity: Array = mean * slope[:, None] + self.velocity[:, None] * ((1.0 - x) * (1.0 - 3.0 * x))
        if self.detours is not None:
            _, first, _ = detour_weights(smooth_step(x[:, 0], 1.0))
            velocity += _drawn_aside(self.detours, first * slope / self.duration)
        return velocity

    def _acceleration(self, x: Array) -> Array:
        """Accelerations likewise [m/s^2]."""
        mean = ((self.target - self.start) / self.duration)[:, None]
        slope, curvature, x = 6.0 * x * (1.0 - x), 6.0 - 12.0 * x, x[:, None]
        from_velocity = self.velocity[:, None] * (6.0 * x - 4.0)
        acceleration: Array = (mean * curvature[:, None] + from_velocity) / self.duration
        if self.detours is not None:
            _, first, second = detour_weights(smooth_step(x[:, 0], 1.0))
            by_x = second * slope**2 + first * curvature
            acceleration += _drawn_aside(self.detours, by_x / self.duration**2)
        return acceleration


def _drawn_aside(detours: Array, weights: Array) -> Array:
    """Sum over control points, shape (point, instant, 3); ``weights`` has shape (control point, instant)."""
    aside: Array = np.einsum("pcx,ct->ptx", detours, weights)
    return aside


def _longest(vectors: Array) -> float:
    return float(np.linalg.norm(vectors, axis=-1).max())
