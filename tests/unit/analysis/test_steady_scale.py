"""The scale of errors: by hand."""

import numpy as np
import pytest

from relform_analysis.plots.steady_scale import Peak, steady_scale

STEADY = np.array([False, False, False, True, True])


def test_scale_holds_everything_that_is_not_far_beyond_steady_state() -> None:
    values = np.array([[0.1, 0.2], [0.25, np.nan], [0.0, 0.1], [0.1, 0.08], [0.05, 0.02]])
    scale = steady_scale(values, STEADY)
    assert (scale.top, scale.peaks) == (pytest.approx(1.05 * 0.25), ())


def test_excursions_are_left_out_and_named() -> None:
    values = np.array([[0.7, 0.2], [0.2, 0.9], [0.0, 0.1], [0.1, 0.08], [0.8, 0.02]])
    steady = np.array([False, False, True, True, False])
    scale = steady_scale(values, steady)
    assert scale.top == pytest.approx(1.5 * 0.1)
    assert scale.peaks == (Peak(1, 0.9), Peak(4, 0.8))


def test_scale_reaches_a_level() -> None:
    values = np.array([[2.0], [0.0], [0.0], [0.01], [0.02]])
    assert steady_scale(values, STEADY, level=0.068).top == pytest.approx(1.05 * 0.068)


@pytest.mark.parametrize("values", [np.full((5, 2), np.nan), np.zeros((5, 2)), np.empty((5, 0))])
def test_nothing_to_scale(values: np.ndarray) -> None:
    assert steady_scale(values, STEADY).top == 1.0


def test_flight_without_steady_steps_shows_everything() -> None:
    values = np.array([[0.5], [0.1]])
    scale = steady_scale(values, np.zeros(2, dtype=bool))
    assert (scale.top, scale.peaks) == (pytest.approx(0.525), ())
