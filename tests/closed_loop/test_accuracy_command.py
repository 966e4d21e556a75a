"""The accuracy command with two short flights of one case: page, sweep of the case, and resumption."""

import json
from pathlib import Path

import pytest

from relform_analysis.accuracy.command import main
from relform_analysis.report.sweep_source import read_sweep
from support.scenarios import paper_scenario
from support.sweeps import files_of, short_phases

CASES = """variants:
  - {name: other, title: not flown, set: []}
  - name: breezy
    title: a breeze on one
    set: ["events=[{kind: wind, target: follower_1, start_s: 0.2, end_s: 0.5, force_n: [0.3, 0.4, 0.0]}]"]
"""


def test_flights_become_a_page(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scenario, cases, out = tmp_path / "short.yaml", tmp_path / "cases.yaml", tmp_path / "out"
    scenario.write_text(paper_scenario(short_phases(0.5)).effective_yaml)
    cases.write_text(CASES)
    command = ["--scenario", str(scenario), "--variants", str(cases), "--cases", "breezy", "--seeds", "2",
               "--raw-seeds", "1", "--first-seed", "31", "--out", str(out), "--jobs", "2"]  # fmt: skip
    assert main(command) == 0
    told = capsys.readouterr()
    page = (out / "accuracy.md").read_text()
    assert told.out == f"{page}\n{out / 'accuracy.md'}\n"
    assert "breezy (1 of 1)" in told.err
    (row,) = [line for line in page.splitlines() if line.startswith("| a breeze on one | team | 2 of 2 |")]

    sweep = read_sweep(out / "breezy")
    raw, team = sweep.report["variants"]
    assert (raw["name"], team["name"], team["runs"]) == ("raw", "team", 2)
    assert team["set"][0] == "controller=team"
    assert [(flight["variant"], flight["seed"]) for flight in sweep.rows] == [
        ("raw", 31), ("team", 31), ("team", 32)
    ]  # fmt: skip
    mean = team["metrics"]["steady_mean_m"]
    assert f"| {mean['mean']:.4f} ({mean['max']:.4f}) |" in row
    assert f"| {team['metrics']['event_peak_m']['mean']:.4f} |" in row
    assert team["metrics"]["position_nees"]["n"] == 2
    assert "position_nees" not in raw["metrics"]  # it knows no covariances

    kept = files_of(out / "breezy")
    assert main(command) == 0
    assert files_of(out / "breezy") == kept
    assert json.loads((out / "breezy/sweep.json").read_text())["variants"][1]["completed"] == 2


def test_unknown_case_is_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--cases", "moon", "--out", str(tmp_path)]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("error: --cases: unknown case 'moon', expected one of nominal, ")
