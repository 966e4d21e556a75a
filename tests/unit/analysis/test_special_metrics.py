"""Numbers of the start and after an event against numbers worked out by hand."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from relform_analysis.flight.metrics import flight_metrics
from relform_analysis.flight.special_metrics import (
    event_metrics,
    settled_time,
    start_metrics,
)
from support.logs import perfect_builder
from support.scenarios import paper_scenario

WIND = "{kind: wind, target: follower_1, start_s: %s, end_s: 20.0, force_n: [0.3, 0.4, 0.0]}"


@pytest.mark.parametrize(
    ("errors", "expected"),
    [
        ([0.01] * 12, 0.0),
        ([0.2] * 3 + [0.04] * 11, 0.15),
        ([0.2, 0.04, 0.04, 0.06] + [0.04] * 11, 0.2),  # it left again
        ([0.2] * 3 + [0.04] * 10, np.nan),  # not for half a second yet
        ([0.05] * 20, np.nan),
        ([np.nan] * 4 + [0.0] * 11, 0.2),
    ],
)
def test_settled_time(errors: Sequence[float], expected: float) -> None:
    times = 0.05 * np.arange(len(errors))
    assert settled_time(times, np.array(errors)) == pytest.approx(expected, nan_ok=True)


def test_start_counts_from_the_first_control_step() -> None:
    log = perfect_builder(paper_scenario(), ["A"] * 20 + ["B"] * 80).build()
    late = replace(log, tick_of_step=log.tick_of_step[10:], phase=log.phase[10:])
    tilts = np.zeros((101, 3))
    tilts[9], tilts[70, 1], tilts[71] = 0.9, 0.3, 0.8  # before the first step, within 3 s after it, later
    errors = np.full((90, 3), 0.01)
    errors[:6, 0] = 0.3
    start = start_metrics(late, errors, tilts)
    assert start.tilt_max == 0.3
    assert start.settled_time == pytest.approx(0.3)


def test_after_an_event_the_rest_of_its_phase_and_steady_windows_count() -> None:
    # A lasts 20 steps, B 100 with a steady window from its 50th step on; the wind begins at 0.4 s.
    events = f"events=[{WIND % 3.0}, {WIND % 0.4}]"
    log = perfect_builder(paper_scenario(events), ["A"] * 20 + ["B"] * 60).build()
    steady = np.zeros(80, dtype=bool)
    steady[70:] = True
    errors, leader = np.zeros((80, 3)), np.zeros(80)
    errors[7], errors[19, 1], errors[40], errors[75, 2] = 0.9, 0.2, 0.8, 0.1
    leader[7], leader[40] = 0.7, 0.5
    event = event_metrics(log, errors, leader, steady)
    assert (event.formation_peak, event.leader_max) == (0.2, 0.5)
    errors[75, 2] = 0.3
    assert event_metrics(log, errors, leader, steady).formation_peak == 0.3


def test_without_an_event_or_before_it_there_are_no_numbers() -> None:
    for events in ("events=[]", f"events=[{WIND % 6.0}]"):
        log = perfect_builder(paper_scenario(events), ["A"] * 20).build()
        event = flight_metrics(log).event
        assert np.isnan([event.formation_peak, event.leader_max]).all()
