"""Blends: smooth steps, and points that move within bounds of speed and acceleration."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from relform_core.arrays import Array
from relform_core.blend import Blend, smooth_step


def test_smooth_step_by_hand() -> None:
    found = smooth_step(np.array([-1.0, 0.0, 0.5, 1.0, 2.0, 3.0]), 2.0)
    np.testing.assert_allclose(found, [0.0, 0.0, 0.15625, 0.5, 1.0, 1.0])
    np.testing.assert_array_equal(smooth_step(np.array([-1e-9, 0.0, 1.0]), 0.0), [0.0, 1.0, 1.0])


def peaks(blend: Blend) -> tuple[float, float]:
    """Speed and acceleration by differences of the positions."""
    time = np.linspace(0.0, blend.duration, 2001)
    velocity = np.gradient(blend.at(time), time, axis=1)
    acceleration = np.gradient(velocity, time, axis=1)[:, 3:-3]
    speeds, accelerations = (np.linalg.norm(rate, axis=2) for rate in (velocity, acceleration))
    return float(speeds.max()), float(accelerations.max())


START = np.array([[0.0, 0.0, 0.0], [1.0, -2.0, 0.5]])


@pytest.mark.parametrize("move", [0.25, 4.0])
@pytest.mark.parametrize(("speed_max", "acceleration_max"), [(1.0, 1.0), (2.0, 0.5), (0.5, 4.0)])
def test_from_rest_the_shortest_blend_reaches_one_of_its_bounds(
    move: float, speed_max: float, acceleration_max: float
) -> None:
    target = START + np.array([[0.0, 0.0, 0.0], [0.0, move, 0.0]])
    blend = Blend.within(START, np.zeros((2, 3)), target, speed_max, acceleration_max)
    speed, acceleration = peaks(blend)
    assert blend.straight
    assert speed < 1.001 * speed_max
    assert acceleration < 1.001 * acceleration_max
    assert max(speed / speed_max, acceleration / acceleration_max) > 0.98


coordinates = st.floats(-5.0, 5.0).map(lambda value: round(value, 3))
vectors = st.tuples(coordinates, coordinates, coordinates)


@given(st.tuples(vectors, vectors), st.tuples(vectors, vectors), st.floats(0.2, 3.0), st.floats(0.2, 5.0))
def test_from_any_velocity_a_blend_keeps_its_bounds_and_comes_to_rest(
    velocity: tuple[object, object], move: tuple[object, object], speed_max: float, acceleration_max: float
) -> None:
    initial: Array = 0.2 * np.array(velocity, dtype=np.float64)
    target = START + np.array(move, dtype=np.float64)
    blend = Blend.within(START, initial, target, speed_max, acceleration_max)
    if blend.duration == 0.0:
        np.testing.assert_array_equal(target, START)
        return
    speed, acceleration = peaks(blend)
    assert speed <= 1.002 * max(speed_max, float(np.linalg.norm(initial, axis=1).max()))
    assert acceleration <= 1.01 * acceleration_max
    before, at_start, at_end, after = np.moveaxis(
        blend.at(np.array([-1.0, 0.0, blend.duration, blend.duration + 1.0])), 1, 0
    )
    np.testing.assert_array_equal(before, START)
    np.testing.assert_array_equal(at_start, START)
    np.testing.assert_allclose(at_end, target, atol=1e-9)
    np.testing.assert_array_equal(after, at_end)
    np.testing.assert_allclose(blend.velocity_at(np.array([0.0]))[:, 0], initial, atol=1e-12)
    np.testing.assert_array_equal(blend.velocity_at(np.array([blend.duration]))[:, 0], np.zeros((2, 3)))
    middle, step = 0.4 * blend.duration, 1e-5 * blend.duration
    ahead, behind = np.moveaxis(blend.at(np.array([middle + step, middle - step])), 1, 0)
    np.testing.assert_allclose(
        blend.velocity_at(np.array([middle]))[:, 0], (ahead - behind) / (2.0 * step), atol=1e-4
    )


def test_a_step() -> None:
    target = START + 1.0
    blend = Blend(START, np.zeros((2, 3)), target, 0.0)
    np.testing.assert_array_equal(blend.at(np.array([0.0]))[:, 0], target)
    np.testing.assert_array_equal(blend.velocity_at(np.array([0.0]))[:, 0], np.zeros((2, 3)))
