"""The report of a sweep in a browser."""

import csv
import json
from pathlib import Path

import pytest

from relform_analysis.report.sweep_page import write_sweep_report
from relform_analysis.report.sweep_source import read_sweep
from relform_analysis.sweep.statistics import aggregate

from .conftest import Tab

SEEDS = range(1, 13)


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("sweep")
    rows = [
        {
            "variant": variant,
            "seed": seed,
            "outcome": "fault" if (variant, seed) == ("far", 5) else "completed",
            "reason": "follower_2 touched the ground" if (variant, seed) == ("far", 5) else None,
            "steady_mean_m": mean * (1.0 + 0.02 * seed),
            "rotor_std_rpm": 600.0 + seed,
        }
        for variant, mean in (("near", 0.06), ("far", 0.6))
        for seed in SEEDS
    ]
    variants = [
        {"name": name, "title": name, "set": []} | aggregate([r for r in rows if r["variant"] == name])
        for name in ("near", "far")
    ]
    (folder / "sweep.json").write_text(json.dumps({"scenario": "paper.yaml", "variants": variants}))
    with (folder / "runs.csv").open("w", newline="") as stream:
        writer = csv.DictWriter(stream, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)
    write_sweep_report(folder / "report.html", read_sweep(folder))
    return folder / "report.html"


def test_a_dot_for_every_completed_flight(tab: Tab, report: Path) -> None:
    tab.open(report)
    strips = tab.page.locator("[data-number=steady_mean_m] tbody tr")
    assert [strip.locator("circle.dot").count() for strip in strips.all()] == [12, 11]
    assert tab.page.locator("[data-number=steady_mean_m] .guide").count() == 2  # the paper's number
    assert (
        tab.page.get_by_text("log scale").count() == 1
    )  # of these two numbers, the one with far apart variants
    assert tab.page.evaluate("document.documentElement.scrollWidth <= innerWidth")


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
    tab.page.locator("[data-number=steady_mean_m] tbody tr").first.locator("[data-seed='12']").hover()
    assert tab.page.locator("#tip").inner_text() == "seed 12, near: 0.074 m"
    assert tab.page.locator(".dot.same").count() == 4
    tab.page.mouse.move(2.0, 2.0)
    assert tab.page.locator(".dot.same").count() == 0
    assert tab.page.locator("#tip").is_hidden()


def test_lost_flights_and_their_reasons(tab: Tab, report: Path) -> None:
    tab.open(report)
    tab.page.get_by_text("Why 1 did not complete").click()
    assert tab.page.locator(".reasons tbody tr").inner_text().split("\t") == [
        "far",
        "5",
        "fault",
        "follower_2 touched the ground",
    ]


def test_dark_and_light(tab: Tab, report: Path) -> None:
    tab.open(report)
    first = tab.page.evaluate("getComputedStyle(document.body).backgroundColor")
    tab.page.keyboard.press("t")
    assert tab.page.evaluate("getComputedStyle(document.body).backgroundColor") != first
