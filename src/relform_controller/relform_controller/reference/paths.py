"""The leader's paths that start and end at rest.

Each function returns the speed ahead [m/s], climb [m/s], turn rate [rad/s] and speed to the left [m/s], shape
(4, time). After the end of the path all are zero.
"""

import math

import numpy as np

from relform_core.arrays import Array
from relform_core.blend import smooth_step, smooth_step_integral
from relform_core.paths_config import Circle, FigureEight, Waypoints
from relform_core.recorded_path_config import RecordedPath


def circle(motion: Circle, time: Array) -> Array:
    """A level circle at ``time`` [s] since its start."""
    speed = _speed(motion, time)
    zero = np.zeros_like(time)
    return np.stack([speed, zero, speed / motion.radius, zero])


def figure_eight(motion: FigureEight, time: Array) -> Array:
    """A level figure eight at ``time`` [s] since its start.

    The heading swings with the length that was flown: by ``EIGHT_TURN * (1 - cos(tau * length / once))``.
    """
    speed = _speed(motion, time)
    angle = math.tau * _length(motion, time) / motion.once
    zero = np.zeros_like(time)
    return np.stack([speed, zero, speed * np.sin(angle) / motion.radius, zero])


def waypoints(motion: Waypoints, time: Array) -> Array:
    """Straight legs with blended corners at ``time`` [s] since the start.

    At each point the velocity changes by a smooth step, the middle of which is when the leg would end at
    constant speed: so the legs that follow are those of the scenario.
    """
    legs = np.array(motion.legs)
    lengths = np.linalg.norm(legs, axis=1)
    velocities = np.zeros((len(legs) + 2, 3))  # at rest, on each leg, at rest
    velocities[1:-1] = motion.speed * legs / lengths[:, None]
    starts = np.concatenate([[0.0], np.cumsum(lengths / motion.speed)])
    velocity = np.zeros((3, time.size))
    for start, change in zip(starts, np.diff(velocities, axis=0), strict=True):
        velocity += change[:, None] * smooth_step(time - start, motion.ramp)
    turn_rate = np.zeros_like(time)
    for start, change in zip(starts[1:-1], np.diff(velocities, axis=0)[1:-1], strict=True):
        x = (time - start) / motion.ramp
        corner = (x > 0.0) & (x < 1.0)
        slope = 6.0 * x[corner] * (1.0 - x[corner]) / motion.ramp
        v_x, v_y = velocity[:2, corner]
        turn_rate[corner] = (v_x * change[1] - v_y * change[0]) * slope / (v_x**2 + v_y**2)
    return np.stack([np.hypot(velocity[0], velocity[1]), velocity[2], turn_rate, np.zeros_like(time)])


def recorded(motion: RecordedPath, time: Array) -> Array:
    """A path through samples at ``time`` [s] since its start; its yaw need not follow its heading."""
    flown = np.minimum(time, motion.time)
    yaw = motion.spline(flown)[:, 3]
    v_x, v_y, climb, turn_rate = np.where(time < motion.time, motion.spline(flown, 1).T, 0.0)
    cosine, sine = np.cos(yaw), np.sin(yaw)
    return np.stack([cosine * v_x + sine * v_y, climb, turn_rate, cosine * v_y - sine * v_x])


def _speed(motion: Circle | FigureEight, time: Array) -> Array:
    """[m/s], shape (time,)."""
    braking = motion.time - motion.ramp
    return motion.speed * (smooth_step(time, motion.ramp) - smooth_step(time - braking, motion.ramp))


def _length(motion: Circle | FigureEight, time: Array) -> Array:
    """Integral of the speed since the start [m], shape (time,)."""
    braking = motion.time - motion.ramp
    ramps = [smooth_step_integral(time - start, motion.ramp) for start in (0.0, braking)]
    return motion.speed * (ramps[0] - ramps[1])
