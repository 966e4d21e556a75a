"""The view moves evenly, a little behind messages that arrive in bursts."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from relform_live.scene.shown_time import ShownTime

STEP_NS = 50_000_000


def test_nothing_is_shown_before_the_first_message() -> None:
    shown = ShownTime()
    assert shown.at(3.0) is None
    assert shown.rate(3.0) is None


def test_moves_evenly_though_messages_are_late() -> None:
    """Messages every 50 ms that come up to 20 ms late; frames at 15 Hz."""
    shown, generator = ShownTime(), np.random.default_rng(7)
    arrivals = [100.0 + 0.05 * step + generator.uniform(0.0, 0.02) for step in range(200)]
    frames, step = [], 0
    for now in np.arange(102.0, 109.0, 1.0 / 15.0):
        while arrivals[step] <= now:
            shown.arrived(step * STEP_NS, arrivals[step])
            step += 1
        frames.append(shown.at(now))
    moves = np.diff(frames) / 1e9
    assert moves == pytest.approx(1.0 / 15.0, abs=0.004)
    assert shown.rate(109.0) == pytest.approx(1.0, rel=0.02)


def test_lags_by_one_and_a_half_intervals() -> None:
    shown = ShownTime()
    for step in range(10):
        shown.arrived(step * STEP_NS, 5.0 + 0.025 * step)  # twice real time
    assert shown.at(5.0 + 0.025 * 9) == pytest.approx(7.5 * STEP_NS)
    assert shown.rate(5.3) == pytest.approx(2.0)


def test_ends_at_the_newest_message() -> None:
    shown = ShownTime()
    for step in range(10):
        shown.arrived(step * STEP_NS, 5.0 + 0.05 * step)
    assert shown.at(60.0) == 9 * STEP_NS
    assert shown.rate(60.0) == 0.0


def test_shows_the_newest_of_one_burst() -> None:
    shown = ShownTime()
    for step in range(10):
        shown.arrived(step * STEP_NS, 5.0)
    assert shown.at(5.0) == 9 * STEP_NS


def test_another_flight_begins_at_its_own_time() -> None:
    shown = ShownTime()
    shown.arrived(500 * STEP_NS, 5.0)
    shown.at(5.1)
    shown.arrived(2 * STEP_NS, 9.0)
    assert shown.at(9.0) == 2 * STEP_NS


@settings(max_examples=50)
@given(st.lists(st.tuples(st.integers(1, 5), st.floats(0.0, 0.3)), min_size=1, max_size=60))
def test_never_goes_back_and_never_ahead(arrivals: list[tuple[int, float]]) -> None:
    shown, step, now, before = ShownTime(), 0, 1.0, 0
    for steps, wait in arrivals:
        step, now = step + steps, now + wait
        shown.arrived(step * STEP_NS, now)
        at = shown.at(now)
        assert at is not None
        assert before <= at <= step * STEP_NS
        before = at
