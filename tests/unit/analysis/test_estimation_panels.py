"""The plots of the estimator: errors, bands of two standard deviations, NIS, mode and rejections."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from relform_analysis.flight.log import FlightLog
from relform_analysis.plots.estimation_panels import estimation_panels
from relform_analysis.plots.panels import Panel
from relform_analysis.report.flight_page import flight_data
from support.logs import perfect_builder
from support.pages import unpack
from support.scenarios import paper_scenario


@pytest.fixture
def log() -> FlightLog:
    return perfect_builder(paper_scenario(), ["A"] * 5).build()


def by_title(log: FlightLog) -> dict[str, Panel]:
    return {panel.title: panel for panel in estimation_panels(log)}


def test_errors_have_bands_of_two_standard_deviations(log: FlightLog) -> None:
    panels = by_title(log)
    pair = panels["Estimate − truth: leader → follower_2, 2σ"]
    assert [line.name for line in pair.lines] == ["x", "y", "z"]
    for line, deviation in zip(pair.lines, (10.0, 20.0, 30.0), strict=True):
        np.testing.assert_allclose(line.values, 10.0)
        np.testing.assert_allclose(line.high, 2.0 * deviation)
    (yaw, *others) = panels["Estimate − truth: relative yaw, 2σ"].lines
    np.testing.assert_allclose(yaw.values, np.degrees(0.25))
    np.testing.assert_allclose(yaw.high, np.degrees(0.1))
    assert [line.name for line in others] == ["leader → follower_2", "follower_2 → follower_1"]
    x, _, z = panels["Estimate − truth: leader, 2σ"].lines
    np.testing.assert_allclose([x.values[0], z.values[0]], [20.0, -30.0])
    np.testing.assert_allclose(x.high, 40.0)
    (leader_yaw,) = panels["Estimate − truth: yaw of leader, 2σ"].lines
    np.testing.assert_allclose(leader_yaw.values, np.degrees(-0.02))


def test_nis_has_its_bounds_per_degree_of_freedom(log: FlightLog) -> None:
    nis, low, high = by_title(log)["NIS of range and bearing per degree of freedom"].lines
    np.testing.assert_allclose(nis.values, 15.5 / 18.0)
    np.testing.assert_allclose([low.values[2], high.values[2]], np.divide(stats.chi2.interval(0.95, 18), 18))


def test_mode_and_rejections(log: FlightLog) -> None:
    panels = by_title(log)
    (mode,) = panels["Estimator: mode (0 measured, 1 predicted, 2 degraded)"].lines
    (rejected,) = panels["Estimator: rejected measurements per step"].lines
    assert mode.values.tolist() == [1.0] * 5
    assert rejected.values.tolist() == [2.0] * 5


def test_without_covariances_and_innovations_only_the_errors_are_drawn(log: FlightLog) -> None:
    raw = replace(
        log,
        pair_covariance=np.full_like(log.pair_covariance, np.nan),
        estimator={**log.estimator, "nis": np.full(5, np.nan)},
    )
    panels = by_title(raw)
    assert all(line.high is None for line in panels["Estimate − truth: leader → follower_1"].lines)
    assert panels["Estimate − truth: leader, 2σ"].lines[0].high is not None
    assert not any(title.startswith("NIS") for title in panels)


def test_flight_of_an_older_version_has_none_of_them(log: FlightLog) -> None:
    unknown = {name: np.full(5, np.nan) for name in log.estimator}
    assert estimation_panels(replace(log, estimator=unknown)) == []


def test_page_holds_the_bands(log: FlightLog) -> None:
    sections = flight_data(log)["sections"]
    panels = {panel["title"]: panel for section in sections for panel in section["panels"]}
    _, y, _ = panels["Estimate − truth: leader → follower_1, 2σ"]["lines"]
    np.testing.assert_allclose(unpack(y["high"]), 40.0)
    assert panels["Formation error"]["lines"][0]["high"] is None
