"""summary.json: complete, without NaN, written atomically; and its table."""

import json
import re
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rich.console import Console

from relform_analysis.flight.log_builder import FlightLogBuilder
from relform_analysis.flight.metrics import flight_metrics
from relform_analysis.flight.summary import Ending, Outcome, build_summary, write_summary
from relform_analysis.report.console import print_table
from relform_core.errors import RelformError
from support.logs import perfect_builder
from support.scenarios import paper_scenario

COMPLETED = Ending(Outcome.COMPLETED, reason=None, wall_time=5.0, flown=30.0)
DOCUMENTATION = Path(__file__).parents[3] / "docs/summary.md"


def summary_of(builder: FlightLogBuilder, ending: Ending = COMPLETED) -> dict[str, Any]:
    metrics = flight_metrics(builder.build())
    return build_summary(paper_scenario(seed=7), metrics, ending, {"relform": "0.1.0", "git_commit": None})


@pytest.fixture
def summary() -> dict[str, Any]:
    builder = perfect_builder(paper_scenario(seed=7), ["A"] * 20 + ["B"] * 60)
    log = builder.build()
    log.p_NB_N[70:, 1] += [0.0, 0.3, 0.4]
    metrics = flight_metrics(log)
    return build_summary(paper_scenario(seed=7), metrics, COMPLETED, {"relform": "0.1.0", "git_commit": None})


def numbers(value: Any) -> list[float]:
    if isinstance(value, dict | list):
        return [n for each in (value.values() if isinstance(value, dict) else value) for n in numbers(each)]
    return [value] if isinstance(value, float) else []


def test_summary_names_scenario_seed_and_vehicles(summary: dict[str, Any]) -> None:
    assert summary["scenario"] == "paper"
    assert summary["seed"] == 7
    assert summary["vehicles"] == ["leader", "follower_1", "follower_2"]
    assert (summary["outcome"], summary["reason"]) == ("completed", None)
    assert (summary["steps"], summary["steps_planned"]) == (80, 540)
    assert summary["realtime_factor"] == 6.0
    assert summary["versions"] == {"relform": "0.1.0", "git_commit": None}


def test_numbers_in_the_units_of_their_keys(summary: dict[str, Any]) -> None:
    assert summary["peak_m"] == pytest.approx(0.5)
    assert summary["steady_mean_m"] == pytest.approx(2 * 10 * 0.5 / (3 * 30))
    assert summary["rotor_max_rpm"] == pytest.approx(430.0 * 60.0 / (2.0 * np.pi))
    assert summary["step_ms_median"] == pytest.approx(3.0)
    assert summary["leader_yaw_max_deg"] == pytest.approx(0.0, abs=1e-6)
    pair = summary["phases"][1]["pairs"][0]
    assert (pair["observer"], pair["target"]) == ("leader", "follower_1")
    assert pair["steady_mean_m"] == pytest.approx(0.5)
    assert pair["mean_m"] == pytest.approx(10 * 0.5 / 60)
    assert summary["phases"][1]["start_s"] == pytest.approx(1.0)


def test_phases_that_were_not_reached_are_null(summary: dict[str, Any]) -> None:
    never = summary["phases"][4]
    assert (never["name"], never["steps"], never["start_s"], never["mean_m"]) == ("E", 0, None, None)


@pytest.mark.parametrize("outcome", [Outcome.INTERRUPTED, Outcome.FAILED, Outcome.FAULT])
def test_flight_that_never_began(tmp_path: Path, outcome: Outcome) -> None:
    ending = Ending(outcome, reason="/leader/quadrotor died", wall_time=0.0, flown=0.0)
    summary = summary_of(FlightLogBuilder(paper_scenario()), ending)
    assert (summary["outcome"], summary["reason"]) == (outcome.value, "/leader/quadrotor died")
    assert summary["realtime_factor"] is None
    assert summary["steady_mean_m"] is None
    write_summary(tmp_path / "summary.json", summary)
    print_table(summary, Console(file=StringIO()))


def test_file_is_strict_json_with_finite_numbers(tmp_path: Path, summary: dict[str, Any]) -> None:
    def refuse(constant: str) -> None:
        raise AssertionError(f"{constant} is no JSON")

    path = tmp_path / "summary.json"
    write_summary(path, summary)
    assert json.loads(path.read_text(), parse_constant=refuse) == summary
    assert np.isfinite(numbers(summary)).all()
    assert [entry.name for entry in tmp_path.iterdir()] == ["summary.json"]


def test_unwritable_file_is_one_line(tmp_path: Path, summary: dict[str, Any]) -> None:
    (tmp_path / "file").touch()
    path = tmp_path / "file/summary.json"
    with pytest.raises(RelformError, match=f"^{re.escape(str(path))}: cannot be written: Not a directory$"):
        write_summary(path, summary)


def test_every_key_is_documented(summary: dict[str, Any]) -> None:
    documented = set(re.findall(r"`(\w+)`", DOCUMENTATION.read_text()))
    phase, pair = summary["phases"][0], summary["pairs"][0]
    assert {*summary, *phase, *pair, *in_real_time()["real_time"]} - documented == set()


def in_real_time() -> dict[str, Any]:
    """The summary of a flight whose nodes have reported twice."""
    scenario = paper_scenario("pacing=real_time", seed=7)
    builder = perfect_builder(scenario, ["A"] * 20)
    for late, ages in ((1, (9.0, 30.0, 77.0)), (2, (3.25, 8.5, 12.0))):
        missed = {"/leader/quadrotor": 0, "/formation/controller": late, "/recorder": 0}
        counts = {f"real_time.missed_steps.{k}": str(n) for k, n in missed.items()}
        builder.add_report("/sim/clock", {**counts, "real_time.held_s": str(0.25 * late)})
        for node, older in (
            ("/formation/controller", -1.0),
            ("/leader/quadrotor", 0.0),
            ("/follower_1/quadrotor", 0.5),
        ):
            keys = ("median", "99_percent", "most")
            values = {
                f"real_time.age_{key}_ms": str(age + older) for key, age in zip(keys, ages, strict=True)
            }
            builder.add_report(node, {"rejected.stale": "4", **values})
    return build_summary(scenario, flight_metrics(builder.build()), COMPLETED, {})


def test_in_real_time_the_oldest_data_counts(summary: dict[str, Any]) -> None:
    assert summary["real_time"] is None
    assert in_real_time()["real_time"] == {
        "missed_steps": {"/leader/quadrotor": 0, "/formation/controller": 2, "/recorder": 0},
        "held_s": 0.5,
        "measurement_age_median_ms": 2.25,
        "measurement_age_p99_ms": 7.5,
        "measurement_age_max_ms": 11.0,
        "command_age_median_ms": 3.75,
        "command_age_p99_ms": 9.0,
        "command_age_max_ms": 12.5,
    }
    output = StringIO()
    print_table(in_real_time(), Console(file=output, width=80))
    assert re.search(r"steps finished late, most +2, /formation/controller", output.getvalue())
    assert re.search(r"command age, 50/99/100 % +3.8 / 9.0 / 12.5 ms", output.getvalue())


def test_table_shows_each_phase_and_pair_and_the_paper(summary: dict[str, Any]) -> None:
    output = StringIO()
    print_table(summary, Console(file=output, width=80))
    text = output.getvalue()
    assert "\x1b" not in text  # no terminal, no colours
    assert max(map(len, text.splitlines())) <= 80
    assert "80 of 540 control steps" in text
    assert "< 0.068 m" in text
    (steady,) = re.findall(r"formation error, steady, mean +(\S+) m", text)
    assert steady == f"{summary['steady_mean_m']:.3f}"
    assert re.search(r"that fell back +0\b", text)
    rows = re.findall(r"^ ?(\S.*?)? +mean +(\S+) +(\S+) +(\S+)", text, flags=re.MULTILINE)
    assert rows[0] == ("leader ->", "0.000", "0.083", "-")


def test_table_of_another_scenario_leaves_the_paper_out(summary: dict[str, Any]) -> None:
    output = StringIO()
    print_table(summary, Console(file=output, width=80), with_paper=False)
    assert "the paper" not in output.getvalue()
    assert re.search(r"smallest separation +\d\.\d\d m", output.getvalue())


def test_table_of_a_flight_that_ended_early_has_no_number_of_steady_state(summary: dict[str, Any]) -> None:
    output = StringIO()
    print_table(summary | {"outcome": Outcome.FAULT.value}, Console(file=output, width=80))
    assert "steady" not in output.getvalue()
    assert re.search(r"formation error, maximum of all +\d\.\d{3} m", output.getvalue())
