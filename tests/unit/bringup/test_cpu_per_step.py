"""CPU time per step, from real processes; how much it is depends on the machine and is not tested."""

import os
import time

import pytest

from relform_bringup.cpu_per_step import FLY, Meter, cpu_time, main
from support.scenarios import PAPER
from support.sweeps import short_phases


def test_cpu_time_is_that_of_the_process() -> None:
    began, own = cpu_time(os.getpid()), time.process_time()
    while time.process_time() - own < 0.2:
        pass
    used = time.process_time() - own
    assert cpu_time(os.getpid()) - began == pytest.approx(used, abs=0.05)


def test_no_cpu_time_of_an_unknown_process() -> None:
    with pytest.raises(OSError, match="/proc/0/stat"):
        cpu_time(0)


def test_a_meter_reads_two_steps() -> None:
    meter = Meter(first=3, last=7)
    for step in range(9):
        meter.read(step, {"/a/b": os.getpid()})
    assert list(meter.cpu_times) == [3, 7]
    assert list(meter.per_step_ms()) == [FLY, "/a/b"]
    meter.cpu_times |= {3: {FLY: 1.0, "/a/b": 2.0}, 7: {FLY: 1.02, "/a/b": 2.002}}
    meter.wall_times |= {3: 10.0, 7: 10.1}
    assert meter.per_step_ms() == pytest.approx({FLY: 5.0, "/a/b": 0.5})
    assert meter.realtime_factor(period=0.05) == pytest.approx(2.0)


def test_a_flight_that_is_too_short(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--scenario", str(PAPER), "--set", short_phases(1.0)]) == 2
    assert "needs at least 81 steps" in capsys.readouterr().err
