"""The benchmark of the solver writes every figure; their values depend on the machine and are not tested."""

import json
from pathlib import Path

import numpy as np
import pytest

from relform_analysis.bench.page import write_page
from relform_analysis.bench.solver import main
from relform_analysis.bench.streams import record, scenario_of
from relform_controller.solver.make import make_solver


def test_figures_without_peer(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "figures.json"
    sizes = ["--vehicles", "2", "--constrained", "2"]
    assert main([*sizes, "--peer", "none", "--instances", "5", "--json", str(file)]) == 0
    printed = capsys.readouterr().out
    assert "One SQP step (ms)" in printed
    assert "With soft constraints" in printed
    figures = json.loads(file.read_text())
    for row in (*figures["rows"], *figures["constrained_rows"]):
        assert (row["vehicles"], row["instances"], figures["peer"]) == (2, 5, None)
        for name in ("ours_ms", "ours_prepare_ms", "ours_feedback_ms", "ours_python_ms"):
            assert 0.0 < row[name]["median"] <= row[name]["p99"] <= row[name]["max"]
        assert "peer_ms" not in row
    assert figures["rows"][0]["constrained_share"] == 0.0


def test_a_team_of_one_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["--vehicles", "1"])
    assert "must be at least 2, not 1" in capsys.readouterr().err


@pytest.mark.parametrize("n_vehicles", [2, 5, 12])
def test_stream_gives_the_steps_of_the_flight_again(n_vehicles: int) -> None:
    stream = record(scenario_of(n_vehicles, "retuned"), 7, begin=0.2)
    assert len(stream.instances) == 7
    assert stream.ocp.n_vehicles == n_vehicles
    first, second = stream.instances[:2]  # two SQP steps of one control step
    assert first.start is second.start
    solver = make_solver(stream.ocp)
    solver.prepare(first.guess, first.geometry_predicted)
    step = solver.feedback(first.start, first.geometry, first.reference)
    np.testing.assert_array_equal(step.plan.thrusts, second.guess.thrusts)
    assert step.active_bounds == first.active_bounds


def test_page_keeps_what_is_around_the_tables(tmp_path: Path) -> None:
    page = tmp_path / "performance.md"
    page.write_text(
        "before\n<!-- begin of measured tables -->\nold\n<!-- end of measured tables -->\nafter\n"
    )
    times = {"median": 0.5, "p99": 0.75, "max": 1.25}
    names = ("ours_ms", "ours_prepare_ms", "ours_feedback_ms", "ours_python_ms", "peer_ms")
    row = {"vehicles": 3, **dict.fromkeys(names, times), "ratio_median": 8.0, "ratio_max": 3.0}
    row |= {"ours_compile_s": 1.0, "ours_memory_mb": 2.0, "active_bounds_max": 4}
    constrained = row | {"vehicles": 7, "constrained_share": 0.416}
    figures = {"machine": "a machine", "peer": "a peer", "rows": [row], "constrained_rows": [constrained]}
    write_page(tmp_path, figures)
    text = page.read_text()
    assert text.startswith("before\n")
    assert text.endswith("\nafter\n")
    assert "| 3 | 0.500 / 0.750 / 1.250 | 0.500, 0.500 | 0.500 / 0.750 / 1.250 | 8.0 | 3.0 |" in text
    assert "active in 42% of the steps:" in text
    assert "| 7 | 0.500 / 0.750 / 1.250 | 0.500, 0.500 | 0.500 / 0.750 / 1.250 | 8.0 | 3.0 |" in text
    assert "old" not in text
    assert (tmp_path / "images/solver_growth.png").exists()
