"""The page of a comparison in a browser, of the recorded flights of tests/data."""

from pathlib import Path

import pytest
from playwright.sync_api import Page

from relform_analysis.report.command import main

from .conftest import Tab, settle

DATA = Path(__file__).parents[1] / "data"
FLIGHTS = 2


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("comparison") / "comparison.html"
    assert main([str(DATA / "short_flight"), str(DATA / "older_flight"), "--out", str(path)]) == 0
    return path


@pytest.fixture
def page(tab: Tab, report: Path) -> Page:
    tab.open(report)
    return tab.page


def picture(page: Page) -> str:
    return str(page.evaluate("document.querySelector('#paths').toDataURL()"))


def number_of(page: Page) -> str:
    """What the first plot tells of the first flight."""
    return page.locator(".plot .u-legend .u-value").nth(1).inner_text()


def test_is_small(report: Path) -> None:
    assert report.stat().st_size < 1_000_000


@pytest.mark.parametrize("tab", ["light", "dark"], indirect=True)
def test_differences_come_first_and_every_plot_has_a_line_per_flight(page: Page) -> None:
    top = [page.locator(part).first.bounding_box() for part in (".configuration", ".headline", "#paths")]
    heights = [box["y"] for box in top if box is not None]
    assert len(heights) == 3
    assert heights == sorted(heights)
    assert page.locator(".configuration tbody tr").count() >= 2
    plots = page.locator(".plot")
    assert plots.count() == len(page.evaluate("relform.plots.plots")) > 15
    for number in (0, 3, plots.count() - 1):
        plots.nth(number).scroll_into_view_if_needed()
        names = plots.nth(number).locator(".u-legend .u-label")
        names.nth(2).wait_for()
        assert names.all_inner_texts()[1:] == ["short_flight", "older_flight"]


def test_time_moves_the_flights_and_the_numbers(page: Page) -> None:
    page.locator(".plot").first.scroll_into_view_if_needed()
    page.locator(".plot .u-legend .u-value").nth(1).wait_for()
    before, number = picture(page), number_of(page)
    page.evaluate("relform.playback.seek(1.4)")
    settle(page)
    assert page.locator("#now").inner_text() == "1.40 s"
    assert picture(page) != before
    assert number_of(page) != number
    page.keyboard.press("ArrowRight")
    assert page.locator("#now").inner_text() == "1.45 s"


def test_paths_are_where_the_truth_says(page: Page) -> None:
    """The same point lies at the same place across in both views, and a metre is as long up as across."""
    seen = page.evaluate(
        """() => {
            const {views: [plan, side], scale} = relform.paths;
            const [a, b] = [[1, 2, 3], [2.5, 4, 3.5]];
            return {plan: [plan.place(a), plan.place(b)], side: [side.place(a), side.place(b)], scale,
                    across: plan.axes[0], away: plan.axes[1], sign: plan.sign};
        }"""
    )
    moved = {0: 1.5, 1: 2.0}
    (a, b), (c, d) = seen["plan"], seen["side"]
    assert b[0] - a[0] == pytest.approx(moved[seen["across"]] * seen["scale"])
    assert b[1] - a[1] == pytest.approx(-seen["sign"] * moved[seen["away"]] * seen["scale"])
    assert (c[0], d[0]) == pytest.approx((a[0], b[0]))
    assert d[1] - c[1] == pytest.approx(-0.5 * seen["scale"])


@pytest.mark.parametrize("width", [360, 2560])
def test_fits_any_screen(page: Page, width: int) -> None:
    page.set_viewport_size({"width": width, "height": 900})
    settle(page)
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    for part in ("#paths", ".plot", ".headline"):
        box = page.locator(part).first.bounding_box()
        assert box is not None
        assert box["x"] >= 0.0
        assert box["width"] > 250.0
