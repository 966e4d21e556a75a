"""The report of a sweep: numbers of sweep.json, a dot per completed flight, every lost flight by name."""

import csv
import json
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from relform_analysis.report.sweep_page import sweep_page, write_sweep_report
from relform_analysis.report.sweep_source import read_sweep
from relform_analysis.sweep.statistics import aggregate
from relform_core.errors import RelformError
from support.pages import Page
from support.scenarios import PAPER

SCRIPT = PAPER.parents[2] / "scripts/report.py"
LOST = {"variant": "bold", "seed": 3, "outcome": "fault", "reason": "follower_1 tilts by 91 deg, <85 allowed"}


def rows_of(variant: str, mean: float) -> list[dict[str, Any]]:
    return [
        {
            "variant": variant,
            "seed": seed,
            "outcome": "completed",
            "reason": None,
            "steady_mean_m": mean + 0.002 * seed,
            "saturated_fraction": 0.01 * seed,
            "phases.B.steady_mean_m": 0.05,
            "kkt_median": 0.5 * seed,
            "realtime_factor": None,
        }
        for seed in range(1, 6)
    ]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """The folder of a sweep over two variants, with one lost flight."""
    rows = [*rows_of("plain", 0.05), *rows_of("bold", 0.3)]
    lost = rows[5 + 2]
    lost.update(LOST, steady_mean_m=9.0, realtime_factor=None)
    variants = [
        {"name": name, "title": f"the {name} one", "set": set_}
        | aggregate([r for r in rows if r["variant"] == name])
        for name, set_ in (("plain", []), ("bold", ["controller.horizon_steps=10"]))
    ]
    report = {"scenario": "some/folder/paper.yaml", "variants": variants, "versions": {"relform": "0.1.0"}}
    (tmp_path / "sweep.json").write_text(json.dumps(report))
    with (tmp_path / "runs.csv").open("w", newline="") as stream:
        writer = csv.DictWriter(stream, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)
    return tmp_path


def test_dots_are_the_completed_flights(folder: Path) -> None:
    number = Page(sweep_page(read_sweep(folder))).data["numbers"]["steady_mean_m"]
    plain, bold = number["variants"]
    assert (plain["seeds"], bold["seeds"]) == ([1, 2, 3, 4, 5], [1, 2, 4, 5])
    np.testing.assert_allclose(plain["values"], [0.052, 0.054, 0.056, 0.058, 0.06])
    np.testing.assert_allclose(plain["quartiles"], [0.054, 0.056, 0.058])
    assert plain["mean"] == pytest.approx(0.056)
    # Student's t with 4 degrees of freedom: 2.776445; deviation 0.0031623 over the root of 5; log scale.
    factor = np.exp(2.776445 * 0.00316228 / 5**0.5 / 0.056)
    np.testing.assert_allclose(plain["ci95"], [0.056 / factor, 0.056 * factor], rtol=1e-4)
    assert number["claim"] == 0.068


def test_name_of_a_variant_may_be_a_number(folder: Path) -> None:
    for name in ("sweep.json", "runs.csv"):
        (folder / name).write_text((folder / name).read_text().replace("plain", "20"))
    first, _ = Page(sweep_page(read_sweep(folder))).data["numbers"]["steady_mean_m"]["variants"]
    assert first["seeds"] == [1, 2, 3, 4, 5]


def test_units_of_the_tables_hold_in_the_plots(folder: Path) -> None:
    number = Page(sweep_page(read_sweep(folder))).data["numbers"]["saturated_fraction"]
    assert (number["label"], number["unit"], number["digits"]) == ("steps with a rotor at its limit", "%", 1)
    plain, _ = number["variants"]
    np.testing.assert_allclose(plain["values"], [1, 2, 3, 4, 5])
    assert (plain["mean"], plain["min"], plain["max"]) == pytest.approx((3.0, 1.0, 5.0))
    assert plain["p95"] == pytest.approx(4.8)


def test_table_is_sweep_json(folder: Path) -> None:
    page = Page(sweep_page(read_sweep(folder)))
    statistics = json.loads((folder / "sweep.json").read_text())["variants"][1]["metrics"]["steady_mean_m"]
    bold = page.data["numbers"]["steady_mean_m"]["variants"][1]
    assert [bold["mean"], *bold["ci95"]] == pytest.approx([statistics["mean"], *statistics["ci95"]], rel=1e-4)
    heading, plain_row, bold_row = page.tables["variants"]
    assert heading == ["variant", "completed", "Formation error, steady m"]
    assert plain_row == ["the plain one", "5/5", "0.056"]
    assert bold_row == ["the bold one", "4/5", "0.306"]
    assert page.tables["changes"][1] == ["the bold one", "bold", "controller.horizon_steps=10"]
    # 0.306 m; the paper says < 0.068 m
    assert re.findall(r'class="missed">([^<]*)<', page.html) == ["4/5", "0.306"]
    assert (page.data["numbers"]["steady_mean_m"]["variants"][0]["holds"], bold["holds"]) == (True, False)


@pytest.mark.parametrize(
    ("scenario", "overrides"),
    [("circle.yaml", []), ("paper.yaml", ["vehicle=crazyflie"]), ("paper.yaml", ["phases.0.duration_s=2"])],
)
def test_another_scenario_than_the_papers_is_not_beside_the_paper(
    folder: Path, scenario: str, overrides: list[str]
) -> None:
    file = folder / "sweep.json"
    report = json.loads(file.read_text()) | {"scenario": scenario, "set": overrides}
    file.write_text(json.dumps(report))
    page = Page(sweep_page(read_sweep(folder)))
    number = page.data["numbers"]["steady_mean_m"]
    assert (number["claim"], number["variants"][1]["holds"]) == (None, None)
    assert "the paper" not in page.text
    assert re.findall(r'class="missed">([^<]*)<', page.html) == ["4/5"]
    file.write_text(json.dumps(report | {"scenario": "paper", "set": ["controller=team"]}))
    assert Page(sweep_page(read_sweep(folder))).data["numbers"]["steady_mean_m"]["claim"] == 0.068


def test_every_lost_flight_is_named_with_its_reason(folder: Path) -> None:
    page = Page(sweep_page(read_sweep(folder)))
    assert page.tables["reasons"][1:] == [["the bold one", "3", "fault", LOST["reason"]]]
    assert "9 completed, 1 crashed" in page.text
    assert "1 of 10 flights did not complete : 1 crashed. No number below includes them." in page.text


def test_numbers_without_values_and_of_phases_are_left_out(folder: Path) -> None:
    numbers = Page(sweep_page(read_sweep(folder))).data["numbers"]
    assert set(numbers) == {"steady_mean_m", "saturated_fraction", "kkt_median"}


def grid_folder(folder: Path) -> Path:
    """The same as a sweep over a grid of 2 x 3, without any flight completed at its last point."""
    values = [(steps, kind) for steps in (20, 5) for kind in ("raw", "team", "other")]
    rows, variants = [], []
    for index, (steps, kind) in enumerate(values):
        name = f"horizon_steps-{steps}_kind-{kind}"
        mine = [{**row, "variant": name} for row in rows_of(name, 0.05 + 0.01 * index)]
        if index == 5:
            mine = [{**row, "outcome": "fault", "reason": "hit the ground"} for row in mine]
        rows += mine
        parameters = {"controller.horizon_steps": steps, "controller.estimator.kind": kind}
        variants.append({"name": name, "title": name, "set": [], "parameters": parameters} | aggregate(mine))
    (folder / "sweep.json").write_text(json.dumps({"scenario": "paper", "variants": variants}))
    with (folder / "runs.csv").open("w", newline="") as stream:
        writer = csv.DictWriter(stream, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)
    return folder


def test_axes_of_a_grid(folder: Path) -> None:
    page = Page(sweep_page(read_sweep(grid_folder(folder))))
    steps, kind = page.data["parameters"]
    assert steps == {
        "key": "controller.horizon_steps",
        "word": "horizon_steps",
        "texts": ["5", "20"],
        "numbers": [5, 20],
    }
    assert (kind["word"], kind["texts"], kind["numbers"]) == ("kind", ["raw", "team", "other"], None)
    assert page.data["places"] == [[1, 0], [1, 1], [1, 2], [0, 0], [0, 1], [0, 2]]
    assert page.data["numbers"]["steady_mean_m"]["variants"][5] is None
    assert page.tables["variants"][1] == ["20", "raw", "5/5", "0.056"]
    assert page.tables["variants"][6] == ["5", "other", "0/5", "-"]
    assert "grid over horizon_steps (2 values) × kind (3 values)" in page.text


def test_numbers_that_are_the_same_everywhere_are_named_without_a_plot(folder: Path) -> None:
    grid_folder(folder)
    html = sweep_page(read_sweep(folder))
    assert re.findall(r'data-plot="(\w+)"', html) == ["steady_mean_m", "saturated_fraction"]
    for name in ("sweep.json", "runs.csv"):
        (folder / name).write_text((folder / name).read_text().replace("kkt_median", "tilt_max_deg"))
    rows = (folder / "runs.csv").read_text()
    assert "tilt_max_deg" in rows
    report = json.loads((folder / "sweep.json").read_text())
    for variant in report["variants"]:
        variant["metrics"]["tilt_max_deg"] |= {"mean": 7.0, "min": 7.0, "max": 7.0}
    (folder / "sweep.json").write_text(json.dumps(report))
    page = Page(sweep_page(read_sweep(folder)))
    assert "The same in every flight: tilt, maximum 7 deg." in page.text
    assert 'data-plot="tilt_max_deg"' not in page.html


def test_report_refers_to_no_other_file(folder: Path) -> None:
    write_sweep_report(folder / "report.html", read_sweep(folder / "sweep.json"))
    page = Page((folder / "report.html").read_text())
    assert all(reference.startswith("data:") for reference in page.references)
    assert "default-src 'none'" in page.html


def error_of(path: Path) -> str:
    with pytest.raises(RelformError) as failure:
        read_sweep(path)
    assert "\n" not in str(failure.value)
    return str(failure.value)


@pytest.mark.parametrize(
    ("name", "content", "expected"),
    [
        ("sweep.json", "{", "sweep.json: cannot be read: Expecting"),
        ("sweep.json", "[]", "sweep.json: cannot be used: it holds no JSON object"),
        ("sweep.json", '{"scenario": "x", "variants": [{"name": "y"}]}', "sweep.json: not of a sweep: needs"),
        ("runs.csv", "", "runs.csv: holds no runs; fly some with the command sweep"),
        ("runs.csv", "a,b\n1,2\n", "runs.csv: holds no runs"),
    ],
)
def test_damaged_folder_is_one_line(folder: Path, name: str, content: str, expected: str) -> None:
    (folder / name).write_text(content)
    assert error_of(folder).startswith(f"{folder / expected}")


def test_table_of_other_runs_than_the_statistics_is_one_line(folder: Path) -> None:
    lines = (folder / "runs.csv").read_text().splitlines()
    (folder / "runs.csv").write_text("\n".join(lines[:-1]))
    expected = "has 4 runs of 'bold', sweep.json has 5; run the command of the sweep again, it writes both"
    assert error_of(folder) == f"{folder / 'runs.csv'}: {expected}"


def test_closed_output_ends_the_script_with_1(folder: Path) -> None:
    reader, writer = os.pipe()
    os.close(reader)
    script = subprocess.run(
        [sys.executable, SCRIPT, str(folder)], stdout=writer, stderr=subprocess.PIPE, text=True
    )
    os.close(writer)
    assert (script.returncode, script.stderr) == (1, "")
    assert (folder / "report.html").is_file()


@pytest.mark.parametrize("name", ["sweep.json", "runs.csv"])
def test_missing_file_is_one_line(folder: Path, name: str) -> None:
    (folder / name).unlink()
    assert error_of(folder) == f"{folder / name}: cannot be read: No such file or directory"
