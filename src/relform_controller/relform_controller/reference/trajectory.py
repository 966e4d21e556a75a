"""The leader's reference: the phases of a scenario as a smooth path with position, velocity and yaw.

Horizontal speed, climb and turn rate blend from one phase into the next, except that a turn has a turn rate
of its own, from zero to zero. The heading is the integral of the turn rate, the position that of the
velocity, and the yaw follows the heading.
"""

import math
from dataclasses import dataclass

import numpy as np

from relform_core.arrays import Array
from relform_core.scenario_config import Hover, Motion, ScenarioConfig, Spiral, Straight, Turn

_SUBSTEPS = 40
"""Integration steps per control period."""


@dataclass(frozen=True, eq=False)
class LeaderReference:
    """Reference of the leader at consecutive control instants."""

    p_NB_N: Array
    """[m], shape (instant, 3)."""
    v_NB_N: Array
    """[m/s], shape (instant, 3)."""
    yaw_NB: Array
    """Continuous, not wrapped [rad], shape (instant,)."""


class LeaderTrajectory:
    """Reference of the leader at every control instant of a flight; after the last phase its motion goes on.

    Args:
        config: the scenario.
        n_extra: control instants beyond the end that must be known, normally the length of the horizon.
    """

    def __init__(self, config: ScenarioConfig, n_extra: int) -> None:
        n_instants = config.n_steps + 1 + n_extra
        step = config.controller.period / _SUBSTEPS
        time = np.linspace(0.0, (n_instants - 1) * config.controller.period, (n_instants - 1) * _SUBSTEPS + 1)
        speed, climb, turn_rate = _profiles(config, time)
        yaw_NB = config.start.yaw + _integral(turn_rate, step)
        v_NB_N = np.stack([speed * np.cos(yaw_NB), speed * np.sin(yaw_NB), climb], axis=-1)
        p_NB_N = np.array(config.start.position) + _integral(v_NB_N, step)
        self._all = LeaderReference(p_NB_N[::_SUBSTEPS], v_NB_N[::_SUBSTEPS], yaw_NB[::_SUBSTEPS])

    def window(self, first_step: int, n_instants: int) -> LeaderReference:
        """The reference at control instants ``first_step`` ... ``first_step + n_instants - 1``.

        Raises:
            IndexError: beyond what is known.
        """
        window = slice(first_step, first_step + n_instants)
        if first_step < 0 or window.stop > len(self._all.yaw_NB):
            raise IndexError(f"no reference at control steps {first_step} ... {window.stop - 1}")
        return LeaderReference(self._all.p_NB_N[window], self._all.v_NB_N[window], self._all.yaw_NB[window])


def _profiles(config: ScenarioConfig, time: Array) -> tuple[Array, Array, Array]:
    """Horizontal speed [m/s], climb [m/s] and turn rate [rad/s] at ``time`` [s]."""
    profiles = np.zeros((3, time.size))
    for phase, start, step in zip(config.phases, config.phase_start_times, config.phase_starts, strict=True):
        begin = step * _SUBSTEPS
        entry = profiles[:, begin]  # what the phase before leads to
        profiles[:, begin:] = _phase_profile(phase.motion, time[begin:] - start, entry)
    return profiles[0], profiles[1], profiles[2]


def _phase_profile(motion: Motion, time: Array, entry: Array) -> Array:
    """Speed, climb and turn rate from the start of a phase on, shape (3, time)."""
    match motion:
        case Hover():
            return _blend(entry, np.zeros(3), time, motion.ramp)
        case Straight():
            return _blend(entry, np.array([motion.speed, 0.0, 0.0]), time, motion.ramp)
        case Spiral():
            speed = math.sqrt(motion.speed**2 - motion.climb**2)
            return _blend(entry, np.array([speed, motion.climb, speed / motion.radius]), time, motion.ramp)
        case Turn():
            x = np.clip(time / motion.turn, 0.0, 1.0)
            profile = np.repeat(entry[:, None], time.size, axis=1)
            profile[2] = motion.angle * 6.0 * x * (1.0 - x) / motion.turn  # derivative of the smooth step
            return profile


def _blend(entry: Array, target: Array, time: Array, ramp: float) -> Array:
    return entry[:, None] + (target - entry)[:, None] * smooth_step(time, ramp)


def smooth_step(time: Array, ramp: float) -> Array:
    """From 0 at time 0 to 1 at ``ramp``, without slope at either end; a step where ``ramp`` is 0."""
    x = np.clip(time / ramp, 0.0, 1.0) if ramp > 0.0 else (time >= 0.0).astype(np.float64)
    return x * x * (3.0 - 2.0 * x)


def _integral(rate: Array, step: float) -> Array:
    """Integral from the first sample on, by the trapezoidal rule along the first axis."""
    integral = np.zeros_like(rate)
    np.cumsum((rate[:-1] + rate[1:]) * (step / 2.0), axis=0, out=integral[1:])
    return integral
