"""Statistics over flights: against numbers worked out by hand, and SciPy."""

import math
from typing import Any

import numpy as np
import pytest
from scipy import stats

from relform_analysis.flight.metrics import flight_metrics
from relform_analysis.flight.summary import Ending, Outcome, build_summary
from relform_analysis.sweep.statistics import aggregate, describe, flatten
from support.logs import perfect_builder
from support.scenarios import paper_scenario

FAILED = {"variant": "v", "seed": 3, "outcome": "failed", "reason": "no compiler", "scenario": "paper"}


def row(seed: int, **numbers: float | str | None) -> dict[str, Any]:
    return {"variant": "v", "seed": seed, "format": 1, "outcome": "completed", "reason": None, **numbers}


def test_by_hand() -> None:
    # 1, 2, 4, 9: mean 4, sum of squares about it 38, t(3, 0.975) = 3.1824; 95 % lies at 0.85 from 4 to 9.
    found = describe([4.0, 1.0, 9.0, 2.0])
    assert (found["n"], found["mean"], found["min"], found["max"]) == (4, 4.0, 1.0, 9.0)
    assert found["std"] == pytest.approx(math.sqrt(38.0 / 3.0))
    assert found["p95"] == pytest.approx(4.0 + 0.85 * 5.0)
    assert found["ci95"] == pytest.approx([4.0 - 5.6632, 4.0 + 5.6632], abs=1e-3)


def test_an_interval_of_positive_numbers_by_hand() -> None:
    # Same values: t times the standard error is 5.6632, over the mean 1.4158; 4 exp(-1.4158), 4 exp(1.4158).
    found = describe([4.0, 1.0, 9.0, 2.0], signed=False)
    assert found["ci95"] == pytest.approx([0.97089, 16.4797], rel=1e-4)
    assert found["mean"] == 4.0


def test_an_interval_of_positive_numbers_is_that_of_student_where_they_are_alike() -> None:
    values = [1.0, 1.001, 0.999, 1.002, 0.998]
    assert describe(values, signed=False)["ci95"] == pytest.approx(describe(values)["ci95"], abs=3e-6)


def test_an_interval_of_positive_numbers_is_positive_and_finite() -> None:
    assert describe([0.0, 0.0, 0.0], signed=False)["ci95"] == [0.0, 0.0]
    low, high = describe([0.0, 1e-9, 1.0], signed=False)["ci95"]
    assert 0.0 < low < 1.0 / 3.0 < high
    assert all(map(math.isfinite, describe([0.0, 1.0], signed=False)["ci95"]))


def test_a_negative_value_keeps_its_interval() -> None:
    assert describe([-1.0, 2.0], signed=False) == describe([-1.0, 2.0])
    found = aggregate(
        [row(1, view_margin_min_deg=0.1, mean_m=0.1), row(2, view_margin_min_deg=8.0, mean_m=8.0)]
    )
    assert found["metrics"]["view_margin_min_deg"]["ci95"][0] < 0.0 < found["metrics"]["mean_m"]["ci95"][0]


def test_against_scipy() -> None:
    values = np.random.default_rng(5).gamma(2.0, 0.03, 37)
    found = describe(values.tolist())
    interval = stats.ttest_1samp(values, 0.0).confidence_interval(0.95)
    assert found["ci95"] == pytest.approx([interval.low, interval.high], rel=1e-12)
    assert found["std"] == pytest.approx(stats.tstd(values), rel=1e-12)
    assert found["p95"] == pytest.approx(stats.scoreatpercentile(values, 95.0), rel=1e-12)


def test_interval_covers_the_mean_in_95_percent_of_samples() -> None:
    generator = np.random.default_rng(11)
    intervals = [describe(generator.normal(0.07, 0.01, 6).tolist())["ci95"] for _ in range(2000)]
    inside = np.mean([low <= 0.07 <= high for low, high in intervals])
    assert inside == pytest.approx(0.95, abs=0.015)


def test_interval_of_skewed_positive_numbers_covers_their_mean_better_than_students() -> None:
    generator = np.random.default_rng(3)
    samples = [generator.gamma(2.0, 0.035, 5).tolist() for _ in range(2000)]
    student, positive = (
        np.mean([low <= 0.07 <= high for low, high in (describe(s, signed)["ci95"] for s in samples)])
        for signed in (True, False)
    )
    assert 0.925 < positive < 0.96
    assert student < positive - 0.01


def test_one_value_has_no_spread_and_none_has_nothing() -> None:
    assert describe([2.5]) == {
        "n": 1, "mean": 2.5, "std": None, "min": 2.5, "p95": 2.5, "max": 2.5, "ci95": None,
    }  # fmt: skip
    assert describe([]) == {
        "n": 0, "mean": None, "std": None, "min": None, "p95": None, "max": None, "ci95": None,
    }  # fmt: skip


def test_a_row_holds_every_number_of_a_summary() -> None:
    log = perfect_builder(paper_scenario(), ["A"] * 20 + ["B"] * 60).build()
    log.p_NB_N[70:, 1] += [0.0, 0.3, 0.4]
    ending = Ending(Outcome.COMPLETED, None, wall_time=2.0, flown=4.0)
    summary = build_summary(paper_scenario(seed=7), flight_metrics(log), ending, {"numpy": "2"})
    found = flatten(summary)

    def leaves(value: Any) -> int:
        if isinstance(value, dict):
            return sum(map(leaves, value.values()))
        return sum(map(leaves, value)) if isinstance(value, list) else 1

    names = 2 * 3 * (1 + len(summary["phases"]))  # observer and target are in the keys
    assert len(found) == leaves(summary) - names - len(summary["vehicles"]) - len(summary["versions"])
    assert found["steady_mean_m"] == summary["steady_mean_m"] > 0.0
    first, _, last = summary["pairs"]
    assert found["pairs.leader.follower_1.steady_mean_m"] == first["steady_mean_m"] > 0.0
    assert found["pairs.follower_2.follower_1.max_m"] == last["max_m"]
    assert found["phases.B.leader_max_m"] == summary["phases"][1]["leader_max_m"]
    assert found["phases.B.pairs.leader.follower_1.max_m"] == summary["phases"][1]["pairs"][0]["max_m"]
    assert found["phases.E.mean_m"] is None


def test_lost_flights_are_counted_but_not_averaged() -> None:
    crashed = {**row(2, steady_mean_m=9.0, late_m=None), "outcome": "fault", "reason": "hit the ground"}
    found = aggregate([FAILED, crashed, row(1, steady_mean_m=0.06, late_m=0.1)])
    assert (found["runs"], found["completed"], found["crashed"], found["failed"]) == (3, 1, 1, 1)
    assert found["reasons"] == [
        {"seed": 3, "outcome": "failed", "reason": "no compiler"},
        {"seed": 2, "outcome": "fault", "reason": "hit the ground"},
    ]
    assert set(found["metrics"]) == {"steady_mean_m", "late_m"}
    assert found["metrics"]["steady_mean_m"]["mean"] == 0.06
    assert found["metrics"]["late_m"]["n"] == 1


def test_a_number_of_lost_flights_only_is_still_listed() -> None:
    crashed = {**row(2, early_m=0.2), "outcome": "fault", "reason": "hit the ground"}
    assert aggregate([crashed])["metrics"]["early_m"] == describe([])


def test_no_flight_at_all() -> None:
    assert aggregate([]) == {
        "runs": 0, "completed": 0, "crashed": 0, "failed": 0, "reasons": [], "metrics": {},
    }  # fmt: skip
