"""The report of a sweep in a browser."""

import csv
import json
import subprocess
import sys
from collections.abc import Sequence
from itertools import product
from pathlib import Path
from typing import Any

import pytest

from relform_analysis.report.sweep_page import write_sweep_report
from relform_analysis.report.sweep_source import read_sweep
from relform_analysis.sweep.statistics import aggregate
from support.scenarios import PAPER

from .conftest import Tab, settle

SEEDS = range(1, 13)
FORMATION, TORQUE = "controller.weights.formation_per_m2", "controller.weights.torque_per_n2_m2"
WIDTHS = (360, 768, 1366, 2560)


def written(folder: Path, rows: Sequence[dict[str, Any]], variants: Sequence[dict[str, Any]]) -> Path:
    """The report of a sweep with these flights."""
    counted = [
        variant | aggregate([r for r in rows if r["variant"] == variant["name"]]) for variant in variants
    ]
    (folder / "sweep.json").write_text(json.dumps({"scenario": "paper.yaml", "variants": counted}))
    with (folder / "runs.csv").open("w", newline="") as stream:
        writer = csv.DictWriter(stream, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)
    write_sweep_report(folder / "report.html", read_sweep(folder))
    return folder / "report.html"


def flight(variant: str, seed: int, error: float, crashes: bool = False) -> dict[str, Any]:
    return {
        "variant": variant,
        "seed": seed,
        "title": "A to E",
        "outcome": "fault" if crashes else "completed",
        "reason": "follower_2 touched the ground" if crashes else None,
        "steady_mean_m": error * (1.0 + 0.02 * seed),
        "rotor_std_rpm": 600.0 + seed,
    }


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> Path:
    means = {"near": 0.06, "far": 0.6}
    rows = [
        flight(variant, seed, mean, crashes=(variant, seed) == ("far", 5))
        for variant, mean in means.items()
        for seed in SEEDS
    ]
    variants = [{"name": name, "title": f"the {name} one", "set": []} for name in means]
    return written(tmp_path_factory.mktemp("sweep"), rows, variants)


@pytest.fixture(scope="module")
def grid_report(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A grid of 5 x 4, whose flights crash at its last point."""
    rows, variants = [], []
    for formation, torque in product((1, 3, 10, 30, 100), (4, 40, 400, 4000)):
        name = f"formation-{formation}_torque-{torque}"
        error = 0.03 + 0.05 / formation + 2e-5 * torque
        rows += [flight(name, seed, error, (formation, torque) == (100, 4000)) for seed in SEEDS[:3]]
        variants.append(
            {
                "name": name,
                "title": f"formation {formation}, torque {torque}",
                "set": [f"{FORMATION}={formation}", f"{TORQUE}={torque}"],
                "parameters": {FORMATION: formation, TORQUE: torque},
            }
        )
    return written(tmp_path_factory.mktemp("grid"), rows, variants)


def test_a_dot_for_every_completed_flight(tab: Tab, report: Path) -> None:
    tab.open(report)
    strips = tab.page.locator(".strips[data-number=steady_mean_m] tbody tr")
    assert [strip.locator("circle.dot").count() for strip in strips.all()] == [12, 11]
    assert [strip.locator("th").inner_text() for strip in strips.all()] == ["the near one", "the far one"]
    assert tab.page.locator(".strips[data-number=steady_mean_m] .guide").count() == 2  # the paper's number
    assert (
        tab.page.get_by_text("log scale").count() == 1
    )  # of these two numbers, the one with far apart variants


def test_means_lie_on_a_common_scale(tab: Tab, report: Path) -> None:
    tab.open(report)
    near, far = (
        mark.bounding_box() for mark in tab.page.locator("[data-number=rotor_std_rpm] .mean-mark").all()
    )
    assert near is not None
    assert far is not None
    assert near["x"] == pytest.approx(far["x"], abs=10.0)  # seed 5 is missing in one of them
    near, far = (
        mark.bounding_box() for mark in tab.page.locator("[data-number=steady_mean_m] .mean-mark").all()
    )
    assert near is not None
    assert far is not None
    assert far["x"] - near["x"] > 300.0


def test_pointing_at_a_flight_finds_its_seed_everywhere(tab: Tab, report: Path) -> None:
    tab.open(report)
    tab.page.locator(".strips[data-number=steady_mean_m] tbody tr").first.locator("[data-seed='12']").hover()
    assert tab.page.locator("#tip").inner_text() == "seed 12, the near one: 0.074 m"
    assert tab.page.locator(".dot.same").count() == 4
    tab.page.mouse.move(2.0, 2.0)
    assert tab.page.locator(".dot.same").count() == 0
    assert tab.page.locator("#tip").is_hidden()


def test_lost_flights_and_their_reasons(tab: Tab, report: Path) -> None:
    tab.open(report)
    assert "1 of 24 flights did not complete: 1 crashed" in tab.page.locator(".alarm").inner_text()
    tab.page.get_by_text("Which, and why").click()
    assert tab.page.locator(".reasons tbody tr").inner_text().split("\t") == [
        "the far one",
        "5",
        "fault",
        "follower_2 touched the ground",
    ]


def test_dark_and_light(tab: Tab, report: Path) -> None:
    tab.open(report)
    first = tab.page.evaluate("getComputedStyle(document.body).backgroundColor")
    tab.page.keyboard.press("t")
    assert tab.page.evaluate("getComputedStyle(document.body).backgroundColor") != first


def test_everything_is_inside_its_card_and_every_axis_has_numbers(
    tab: Tab, report: Path, grid_report: Path
) -> None:
    for width, page in product(WIDTHS, (report, grid_report)):
        tab.page.set_viewport_size({"width": width, "height": 900})
        tab.open(page)
        assert tab.page.evaluate("document.documentElement.scrollWidth <= innerWidth"), width
        for axis in tab.page.locator(".axis svg:visible").all():
            assert axis.locator("text").count() >= 2, width
        outside = tab.page.evaluate(
            """() => [...document.querySelectorAll(".card")].filter((card) => {
              const right = card.getBoundingClientRect().right;
              return [...card.children].some((child) => child.getBoundingClientRect().right > right + 0.5);
            }).length"""
        )
        assert outside == 0, width


def test_a_long_sweep_is_a_table_that_can_be_sorted(tab: Tab, grid_report: Path) -> None:
    tab.open(grid_report)
    assert tab.page.locator(".strips").count() == 1
    rows = tab.page.locator(".variants tbody tr")
    assert rows.count() == 20
    error = tab.page.get_by_role("button", name="Formation error, steady")
    error.click()
    # 0.03 + 0.05 / formation + 2e-5 torque, times 1.04 in the mean over seeds 1 to 3.
    assert rows.first.inner_text().split() == ["100", "4", "3/3", f"{1.04 * 0.03058:.3f}", "602"]
    assert rows.last.inner_text().split() == ["100", "4000", "0/3", "-", "-"]
    error.click()
    assert rows.first.inner_text().split()[:2] == ["1", "4000"]
    assert rows.last.inner_text().split()[:2] == ["100", "4000"]
    tab.page.get_by_role("button", name="torque", exact=True).click()
    assert rows.first.inner_text().split()[1] == "4"
    assert rows.nth(19).inner_text().split()[1] == "4000"


def test_a_choice_shows_the_flights_of_another_number(tab: Tab, grid_report: Path) -> None:
    tab.open(grid_report)
    assert tab.page.locator(".strips tbody tr").first.locator(".mean").inner_text() == "0.083 m"
    tab.page.get_by_label("Flights of every variant").select_option("rotor_std_rpm")
    assert tab.page.locator(".strips tbody tr").first.locator(".mean").inner_text() == "602 rpm"
    assert tab.page.locator(".strips .dot").count() == 3 * 19


def test_heat_map_of_two_parameters(tab: Tab, grid_report: Path) -> None:
    tab.open(grid_report)
    cells = tab.page.locator("[data-plot=steady_mean_m] tbody tr")
    assert cells.count() == 5
    assert cells.nth(2).inner_text().split() == [
        "10",
        *(f"{1.04 * (0.035 + 2e-5 * t):.3f}" for t in (4, 40, 400, 4000)),
    ]
    assert cells.last.locator("td").last.inner_text() == "-\n▲ 3 of 3 lost"
    colours = [
        cells.nth(row).locator("td").nth(0).evaluate("cell => getComputedStyle(cell).backgroundColor")
        for row in (0, 4)
    ]
    assert colours[0] != colours[1]
    cells.nth(0).locator("td").nth(1).hover()
    assert tab.page.locator("#tip").inner_text().startswith("formation 1, torque 40: 0.084 m (95 %: 0.0")
    tab.page.get_by_label("across").select_option("formation")
    assert tab.page.locator("[data-plot=steady_mean_m] tbody tr").count() == 4


def test_curves_of_two_parameters(tab: Tab, grid_report: Path) -> None:
    tab.open(grid_report)
    tab.page.get_by_role("button", name="curves").click()
    plot = tab.page.locator("[data-plot=steady_mean_m] svg")
    assert plot.locator(".curve").count() == 5
    assert plot.locator(".point").count() == 19
    assert plot.locator(".lost").count() == 1
    assert tab.page.locator(".series").inner_text().split() == ["formation", "1", "3", "10", "30", "100"]
    tab.page.get_by_label("a line for each").select_option("torque")
    settle(tab.page)
    assert plot.locator(".curve").count() == 4
    # A larger weight on the formation, a smaller error: the first line falls.
    ends = (
        plot.locator("g")
        .first.locator(".point")
        .evaluate_all("points => points.map(point => [+point.getAttribute('cx'), +point.getAttribute('cy')])")
    )
    assert [x for x, _ in ends] == sorted(x for x, _ in ends)
    assert [y for _, y in ends] == sorted(y for _, y in ends)


def test_picture_for_the_documentation(report: Path, tmp_path: Path) -> None:
    """In a process of its own, because Playwright starts once in each."""
    script = PAPER.parents[2] / "scripts/screenshot.py"
    picture = tmp_path / "sweep.png"
    size = ("--width", "420", "--height", "300", "--dark")
    command = [sys.executable, str(script), str(report), str(picture), *size]
    subprocess.run(command, check=True)
    header = picture.read_bytes()[:24]
    assert header.startswith(b"\x89PNG\r\n\x1a\n")
    assert (int.from_bytes(header[16:20]), int.from_bytes(header[20:24])) == (420, 300)
    command[2] = str(tmp_path / "none.html")
    failed = subprocess.run(command, capture_output=True, text=True)
    assert (failed.returncode, failed.stderr) == (2, f"error: {command[2]}: no such file\n")
