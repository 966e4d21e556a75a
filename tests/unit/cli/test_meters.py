"""Reports of `ros2 topic hz`, `bw` and `delay` on messages at known times."""

import pytest

from relform_cli.meters import BandwidthMeter, DelayMeter, RateMeter

MS = 1_000_000


def test_rate() -> None:
    meter = RateMeter(window=100)
    for now in (1000, 1010, 1030, 1040):
        meter.take(now * MS, 0)
    assert meter.report(1050 * MS) == (
        "average rate: 75.000\n\tmin: 0.010s max: 0.020s std dev: 0.00471s window: 3"
    )


def test_rate_over_the_last_messages_only() -> None:
    meter = RateMeter(window=2)
    for now in (0, 500, 510, 520):
        meter.take(now * MS, 0)
    assert meter.report(530 * MS) == (
        "average rate: 100.000\n\tmin: 0.010s max: 0.010s std dev: 0.00000s window: 2"
    )


def test_rate_reports_nothing_without_new_messages() -> None:
    meter = RateMeter(window=2)
    meter.take(500 * MS, 0)
    assert meter.report(510 * MS) is None
    meter.take(600 * MS, 0)
    assert meter.report(610 * MS) is not None
    assert meter.report(1610 * MS) is None


def test_rate_restarts_when_time_goes_back(capsys: pytest.CaptureFixture[str]) -> None:
    meter = RateMeter(window=9)
    for now in (7000, 7010, 30, 80):
        meter.take(now * MS, 0)
    assert capsys.readouterr().out == "time has reset, resetting counters\n"
    assert (meter.report(90 * MS) or "").startswith("average rate: 20.000\n")


def test_delay() -> None:
    meter = DelayMeter(window=9)
    assert meter.report(0) is None
    meter.take(1000 * MS, 990 * MS)
    meter.take(1100 * MS, 1070 * MS)
    assert meter.report(0) == "average delay: 0.020\n\tmin: 0.010s max: 0.030s std dev: 0.01000s window: 2"
    assert meter.report(0) == "no new messages"


@pytest.mark.parametrize(
    ("size", "expected"),
    [
        (30, "300 B/s from 2 messages\n\tMessage size mean: 30 B min: 30 B max: 30 B"),
        (3000, "30.00 KB/s from 2 messages\n\tMessage size mean: 3.00 KB min: 3.00 KB max: 3.00 KB"),
        (4_500_000, "45.00 MB/s from 2 messages\n\tMessage size mean: 4.50 MB min: 4.50 MB max: 4.50 MB"),
    ],
)
def test_bandwidth(size: int, expected: str) -> None:
    meter = BandwidthMeter(window=2)
    meter.take(600 * MS, 7)  # falls out of the window
    meter.take(700 * MS, size)
    assert meter.report(750 * MS) is not None
    meter.take(800 * MS, size)
    assert meter.report(900 * MS) == expected


def test_bandwidth_restarts_when_time_goes_back(capsys: pytest.CaptureFixture[str]) -> None:
    meter = BandwidthMeter(window=9)
    meter.take(700 * MS, 10)
    meter.take(710 * MS, 10)
    assert meter.report(20 * MS) is None
    assert capsys.readouterr().err == "WARNING: time is reset!\n"
