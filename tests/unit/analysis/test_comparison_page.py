"""The page of a comparison: its tables and data."""

import numpy as np
import pytest

from relform_analysis.comparison.compare import compare
from relform_analysis.comparison.flights import ComparedFlight
from relform_analysis.report.comparison_page import comparison_page
from relform_analysis.report.flight_source import summary_of
from support.logs import perfect_builder
from support.pages import Page, unpack
from support.scenarios import paper_scenario


def flown(label: str, seed: int, steps: int) -> ComparedFlight:
    log = perfect_builder(paper_scenario(seed=seed), ["A"] * 20 + ["B"] * steps).build()
    log.p_NB_N[:, 1] += [0.0, 0.0, 0.03 * seed]
    return ComparedFlight(label, f"runs/<{label}>", log, summary_of(log))


def test_tables_and_lines_of_two_flights() -> None:
    page = Page(comparison_page(compare([flown("one", 1, 60), flown("two", 2, 30)])))
    assert page.tables["configuration"][1:] == [["seed", "seed", "1", "2"]]
    assert [row[1:] for row in page.tables["results headline"][1:2]] == [["0.020", "0.040", "+0.020", "2.00"]]
    assert [row[3:5] for row in page.tables["flights"][1:]] == [["1", "4.00 s"], ["2", "2.50 s"]]
    assert "runs/<one>" in page.text
    assert "one after 2.45 s: not every flight lasted longer." in page.text
    assert page.references == ["data:,"]
    panels = {panel["title"]: panel for panel in page.data["panels"]}
    one, two = (unpack(line["values"]) for line in panels["Formation error, mean of the pairs"]["lines"])
    steps = [unpack(flight["step"]) for flight in page.data["flights"]]
    assert [one.shape, two.shape] == [each.shape for each in steps] == [(80,), (50,)]
    np.testing.assert_allclose(one, 0.02, rtol=1e-6)
    np.testing.assert_allclose(two, 0.04, rtol=1e-6)


def test_equal_flights_say_so() -> None:
    page = Page(comparison_page(compare([flown("one", 1, 10), flown("two", 1, 10)])))
    assert "Nothing: configuration, seed and software are the same." in page.text
    assert "Truth and commands of the flights are equal, bit for bit." in page.text
    assert "Not compared" not in page.text


@pytest.mark.parametrize("outcome", ["completed", "fault"])
def test_flight_that_did_not_complete_says_so(outcome: str) -> None:
    first, second = flown("one", 1, 10), flown("two", 2, 10)
    second.summary["outcome"], second.summary["reason"] = outcome, "follower_1 touched the ground"
    page = Page(comparison_page(compare([first, second])))
    assert ("fault follower_1 touched the ground" in page.text) == (outcome == "fault")
    early = "two ended early (follower_1 touched the ground): its numbers are of the time before."
    assert (early in page.text) == (outcome == "fault")
