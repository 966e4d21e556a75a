"""Flights of a sweep in a comparison: found by variant and seed, and flown again where no log was kept."""

from pathlib import Path

import numpy as np
import pytest

from relform_analysis.flight.simulate import fly_in_process
from relform_analysis.report.command import main
from relform_analysis.report.comparison_source import read_flights
from relform_analysis.sweep.flight_row import fly
from relform_analysis.sweep.folder import SweepFolder
from relform_analysis.sweep.plan import plan_runs
from relform_core.errors import RelformError
from support.scenarios import PAPER
from support.sweeps import BASE, LOOSE, short_phases

CHANGES = (short_phases(0.25),)


@pytest.fixture(scope="module")
def sweep(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two variants with the seeds 3 and 4."""
    path = tmp_path_factory.mktemp("sweep")
    with SweepFolder(path) as folder:
        runs = plan_runs(PAPER, (BASE, LOOSE), CHANGES, (3, 4))
        rows = []
        for run in runs:
            row, _ = fly(run)
            folder.store(run, row)
            rows.append(row)
        folder.conclude(str(PAPER), CHANGES, (BASE, LOOSE), rows, {"relform": "1.2.3"})
    return path


def test_flight_of_a_variant_is_the_one_that_the_sweep_flew(sweep: Path) -> None:
    first, second = read_flights([f"{sweep}:base", f"{sweep}:loose-s4"], None)
    assert (first.label, second.label) == (f"{sweep.name}:base", f"{sweep.name}:loose-s4")
    assert (first.log.scenario.seed, second.log.scenario.seed) == (3, 4)
    (run,) = plan_runs(PAPER, (LOOSE,), CHANGES, (4,))
    np.testing.assert_array_equal(second.log.rotor_speeds, fly_in_process(run.scenario).rotor_speeds)
    assert second.summary["versions"] == {"relform": "1.2.3"}


@pytest.mark.parametrize(
    ("name", "problem"),
    [
        (":firm", "unknown variant firm, expected one of base, loose"),
        (":loose-s9", "no flight with seed 9; seeds of loose are 3, 4"),
    ],
)
def test_unknown_flight_is_one_line(
    sweep: Path, capsys: pytest.CaptureFixture[str], name: str, problem: str
) -> None:
    assert main([f"{sweep}:base", f"{sweep}{name}"]) == 2
    assert capsys.readouterr().err == f"error: {sweep}{name}: {problem}\n"


def test_whole_sweep_is_no_flight(sweep: Path) -> None:
    problem = f"^{sweep}: a sweep of many flights; name one to compare, as {sweep}:VARIANT$"
    with pytest.raises(RelformError, match=problem):
        read_flights([f"{sweep}:base", str(sweep)], None)


def test_changed_flight_is_refused(sweep: Path) -> None:
    file = sweep / "runs/base-s3.json"
    text = file.read_text()
    file.write_text(text.replace('"fingerprint": "', '"fingerprint": "0'))
    try:
        with pytest.raises(
            RelformError, match="software changed since it was flown; run the command of the sweep"
        ):
            read_flights([f"{sweep}:base", f"{sweep}:loose"], None)
    finally:
        file.write_text(text)
