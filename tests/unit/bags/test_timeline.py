"""Bag time over steady time."""

import pytest

from relform_bags.timeline import Timeline

S = 1_000_000_000


def test_bag_time_runs_at_its_rate() -> None:
    timeline = Timeline(7 * S, rate=2.5, now=100.0, paused=False)
    assert timeline.bag_time_ns(100.0) == 7 * S
    assert timeline.bag_time_ns(102.0) == 12 * S
    assert timeline.wait_for(17 * S, now=102.0) == pytest.approx(2.0)
    assert timeline.wait_for(11 * S, now=102.0) == 0.0, "an overdue message is due immediately"


def test_pause_stops_bag_time() -> None:
    timeline = Timeline(0, rate=0.5, now=10.0, paused=False)
    timeline.toggle_pause(now=14.0)
    assert timeline.paused
    assert timeline.bag_time_ns(500.0) == 2 * S
    assert timeline.wait_for(2 * S, now=500.0) is None
    timeline.toggle_pause(now=1000.0)
    assert timeline.bag_time_ns(1002.0) == 3 * S


def test_new_rate_applies_from_now_on() -> None:
    timeline = Timeline(0, rate=1.0, now=0.0, paused=False)
    timeline.set_rate(4.0, now=3.0)
    assert timeline.bag_time_ns(5.0) == 11 * S
    timeline.set_rate(0.5, now=5.0)
    assert timeline.rate == 0.5
    assert timeline.bag_time_ns(7.0) == 12 * S


def test_jump_moves_bag_time_also_in_a_pause() -> None:
    timeline = Timeline(3 * S, rate=1.0, now=0.0, paused=True)
    timeline.jump(8 * S, now=2.0)
    assert timeline.bag_time_ns(50.0) == 8 * S
    timeline.toggle_pause(now=60.0)
    assert timeline.bag_time_ns(61.5) == 8 * S + S * 3 // 2
