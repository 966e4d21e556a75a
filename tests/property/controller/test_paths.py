"""Laws of the leader's paths, for any circle, figure eight and course of waypoints."""

import math

import numpy as np
from hypothesis import assume, given
from hypothesis import strategies as st
from pydantic import ValidationError

from relform_controller.reference.paths import circle, figure_eight, waypoints
from relform_core.arrays import Array
from relform_core.paths_config import ACCELERATION_MAX, Circle, FigureEight, Waypoints

N = 40001
"""Samples of a path."""
speeds = st.floats(0.2, 4.0)
ramps = st.floats(0.3, 3.0)
radii = st.builds(math.copysign, st.floats(0.5, 8.0), st.sampled_from([-1.0, 1.0]))


@st.composite
def motions(draw: st.DrawFn) -> Circle | FigureEight | Waypoints:
    common = {"speed_m_s": draw(speeds), "ramp_s": draw(ramps)}
    kind = draw(st.sampled_from(["circle", "figure_eight", "waypoints"]))
    try:
        if kind == "waypoints":
            return Waypoints.model_validate(common | {"kind": kind, "points_m": draw(courses())})
        rounds = common | {"kind": kind, "radius_m": draw(radii), "turns": draw(st.integers(1, 3))}
        return (Circle if kind == "circle" else FigureEight).model_validate(rounds)
    except ValidationError:
        assume(False)
        raise


@st.composite
def courses(draw: st.DrawFn) -> tuple[tuple[float, float, float], ...]:
    """Points one after the other, by length, turn and climb of each leg."""
    points, heading, place = [], 0.0, np.zeros(3)
    for index in range(draw(st.integers(1, 4))):
        length, climb = draw(st.floats(3.0, 12.0)), draw(st.floats(-0.9, 0.9))
        heading += draw(st.floats(-2.0, 2.0)) if index else 0.0
        level = length * math.cos(climb)
        place = place + [level * math.cos(heading), level * math.sin(heading), length * math.sin(climb)]
        points.append((float(place[0]), float(place[1]), float(place[2])))
    return tuple(points)


def profile(motion: Circle | FigureEight | Waypoints) -> tuple[Array, Array]:
    """Instants [s] up to a second after the end, and speed, climb and turn rate at them."""
    time = np.linspace(0.0, motion.time + 1.0, N)
    match motion:
        case Circle():
            return time, circle(motion, time)
        case FigureEight():
            return time, figure_eight(motion, time)
        case Waypoints():
            return time, waypoints(motion, time)


def integral(rate: Array, time: Array) -> Array:
    """By the trapezoidal rule, from zero, along the last axis."""
    steps = 0.5 * (rate[..., 1:] + rate[..., :-1]) * np.diff(time)
    return np.concatenate([np.zeros_like(rate[..., :1]), np.cumsum(steps, axis=-1)], axis=-1)


@given(motions())
def test_path_keeps_its_bounds_and_ends_where_it_should(motion: Circle | FigureEight | Waypoints) -> None:
    time, (speed, climb, turn_rate, _) = profile(motion)
    assert (speed >= 0.0).all()
    assert np.hypot(speed, climb).max() <= motion.speed * (1.0 + 1e-9)
    np.testing.assert_allclose([speed[0], climb[0], turn_rate[0]], 0.0, atol=1e-12)
    after = time >= motion.time
    np.testing.assert_allclose([speed[after], climb[after], turn_rate[after]], 0.0, atol=1e-9)

    yaw = integral(turn_rate, time)
    velocity = np.stack([speed * np.cos(yaw), speed * np.sin(yaw), climb])
    end = integral(velocity, time)[:, -1]
    expected = motion.points[-1] if isinstance(motion, Waypoints) else (0.0, 0.0, 0.0)
    np.testing.assert_allclose(end, expected, atol=2e-3)


@given(motions())
def test_velocity_is_continuous_and_acceleration_bounded(motion: Circle | FigureEight | Waypoints) -> None:
    """Corners and ramps included. With half the step the largest change halves; a jump would stay."""
    time, (speed, climb, turn_rate, _) = profile(motion)
    yaw = integral(turn_rate, time)
    velocity = np.stack([speed * np.cos(yaw), speed * np.sin(yaw), climb])
    acceleration = np.diff(velocity, axis=1) / np.diff(time)
    # The configuration bounds the accelerations along and across the path.
    assert np.linalg.norm(acceleration, axis=0).max() <= math.sqrt(2.0) * ACCELERATION_MAX * 1.01
    for values in (*velocity, turn_rate):
        coarse, fine = (np.abs(np.diff(values[::every])).max() for every in (2, 1))
        assert fine <= 0.7 * coarse + 1e-9
