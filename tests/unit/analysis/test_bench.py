"""The benchmark prints every number; their values depend on the machine and are not tested."""

import re

import pytest

from relform_analysis.bench.flight import main
from support.scenarios import PAPER
from support.sweeps import short_phases


def test_every_number_of_short_flights(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--scenario", str(PAPER), "--set", short_phases(1.0), "--flights", "2"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].strip() == "paper: 3 vehicles, 2 flights of 1 s"
    numbers = {
        name.strip(): [float(number) for number in values.split()]
        for name, values in re.findall(r"^ (\S.*?)((?:\s+[0-9.]+){4})\s*$", "\n".join(lines), re.MULTILINE)
    }
    assert len(numbers) == 11
    for median, least, high, most in numbers.values():
        assert 0.0 < least <= median <= high <= most
    assert numbers["SQP steps per control step"][3] == 2.0
    (factor, *_), (cpu_time, *_) = (
        numbers["real-time factor on one core"],
        numbers["CPU time of a flight (s)"],
    )
    assert factor == pytest.approx(1.0 / cpu_time, rel=0.2)


def test_unknown_key(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--scenario", str(PAPER), "--set", "controller.wings=2"]) == 2
    assert capsys.readouterr().err == "error: --set controller.wings: unknown key (did you mean 'weights'?)\n"
