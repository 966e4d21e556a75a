"""The accuracy table: its targets against made-up results, its page, and its cases."""

from pathlib import Path
from typing import Any

import pytest

from relform_analysis.accuracy.command import by_estimator, choose
from relform_analysis.accuracy.goals import GOALS, NOMINAL, Goal, drift, leader, steady
from relform_analysis.accuracy.page import Case, accuracy_page, verdicts
from relform_analysis.sweep.plan import load_variants, plan_runs
from relform_core.errors import ConfigError
from support.scenarios import CONFIG_FOLDER, PAPER

CASES = load_variants(CONFIG_FOLDER / "sweeps/accuracy.yaml")


def metric(mean: float, n: int = 50) -> dict[str, Any]:
    return {"n": n, "mean": mean, "min": 0.5 * mean, "max": 2.0 * mean}


def variant(completed: int = 50, **metrics: dict[str, Any]) -> dict[str, Any]:
    return {"runs": 50, "completed": completed, "metrics": metrics}


def kept(*goals: Goal) -> dict[str, Any]:
    """Results that keep these bounds, of which those from both sides are half-way."""
    bounds: dict[str, list[float]] = {}
    for goal in goals:
        scale = {"mean": 1.0, "min": 2.0, "max": 0.5}[goal.statistic] / goal.factor
        bounds.setdefault(goal.key, []).append(goal.bound * scale)
    return variant(**{key: metric(sum(each) / len(each)) for key, each in bounds.items()})


def case(name: str, team: dict[str, Any], raw: dict[str, Any] | None = None) -> Case:
    return Case(name, f"title of {name}", variant() if raw is None else raw, team)


def test_cases_and_targets_have_the_same_names() -> None:
    assert {each.name for each in CASES} == GOALS.keys()


def test_every_case_can_be_flown_with_both_estimators() -> None:
    for each in CASES:
        raw, team = plan_runs(PAPER, by_estimator(each), (), [7])
        assert (raw.variant, team.variant) == ("raw", "team")
        kinds = [run.scenario.config.controller.estimator.kind for run in (raw, team)]
        assert kinds == ["raw", "team"]
        assert raw.scenario.config.events == team.scenario.config.events


def test_disturbances_in_mid_flight_act_to_its_end() -> None:
    for each in CASES:
        (run,) = plan_runs(PAPER, [each], (), [7])
        for event in run.scenario.config.events:
            if event.kind in ("wind", "thrust_scale"):
                assert (event.start, event.end) == (8.0, run.scenario.config.duration)


@pytest.mark.parametrize(
    ("factor", "folder"), [(2.0, "noise_x2"), (4.0, "noise_x4")], ids=["twice", "four times"]
)
def test_more_noise_is_more_of_all_noise(factor: float, folder: str) -> None:
    (noisy,) = plan_runs(PAPER, [each for each in CASES if each.name == folder], (), [7])
    (paper,) = plan_runs(PAPER, [each for each in CASES if each.name == NOMINAL], (), [7])
    found = noisy.scenario.config.sensors.model_dump(exclude_none=True)
    compared = 0
    for sensor, keys in paper.scenario.config.sensors.model_dump(exclude_none=True).items():
        for key, value in keys.items():
            expected = factor * value if key.endswith("_std") else value
            assert found[sensor][key] == (expected if key == "sectors" else pytest.approx(expected)), key
            compared += key.endswith("_std")
    assert compared == 10


def test_kept_targets() -> None:
    cases = [case(name, kept(*goals)) for name, goals in GOALS.items() if name != "localization_out"]
    assert [verdict.line for verdict in verdicts(cases) if not verdict.is_met] == []


def test_missed_targets_name_case_number_and_bound() -> None:
    lost = kept(*GOALS["combined"]) | {"completed": 48}
    lost["metrics"]["steady_mean_m"] = metric(0.01712, n=48)
    missed = [verdict.line for verdict in verdicts([case("combined", lost)]) if not verdict.is_met]
    assert missed == [
        "combined: flights completed: 48, must be 50",
        "combined: formation, steady mean: 0.0171 m, must be at most 0.0170 m",
    ]


def test_a_number_that_some_flights_lack_is_unknown() -> None:
    start = kept(*GOALS["start"])
    start["metrics"]["start_settled_s"] = metric(1.0, n=49)
    (missed,) = [verdict for verdict in verdicts([case("start", start)]) if not verdict.is_met]
    assert missed.line == "start: settled below 0.05 m after: unknown, must be at most 3.00 s"


@pytest.mark.parametrize(("mean", "is_met"), [(0.0095, True), (0.0097, False)])
def test_bound_relative_to_the_nominal_case(mean: float, is_met: bool) -> None:
    nominal = case(NOMINAL, kept(*GOALS[NOMINAL]))
    nominal.team["metrics"]["steady_mean_m"] = metric(0.008)
    out = case("localization_out", kept(drift(0.1)))
    out.team["metrics"]["steady_mean_m"] = metric(mean)
    (formation,) = [
        verdict
        for verdict in verdicts([nominal, out])
        if verdict.case is out and verdict.label == steady(1.0).label
    ]
    assert (formation.wanted, formation.is_met) == ("at most 0.0096 m", is_met)
    alone = next(verdict for verdict in verdicts([out]) if verdict.label == steady(1.0).label)
    assert (alone.wanted, alone.is_met) == ("at most unknown", False)


def test_lower_bounds_and_factors() -> None:
    closest = next(goal for goal in GOALS["start"] if goal.is_lower)
    assert closest.is_met(variant(separation_min_m=metric(1.02)), None)
    assert not closest.is_met(variant(separation_min_m=metric(0.98)), None)
    saturated = GOALS["eight"][-1]
    assert saturated.text(saturated.found(variant(saturated_fraction=metric(0.0123)))) == "1.2 %"
    assert not leader(0.05).is_met(variant(), None)


def test_page_shows_raw_beside_team() -> None:
    team = kept(*GOALS["drag"]) | {"completed": 49}
    team["metrics"]["saturated_fraction"] = metric(0.01)
    raw = variant(0, steady_mean_m={"n": 0, "mean": None, "min": None, "max": None})
    page = accuracy_page([case("drag", team, raw)], range(2001, 2051), 10, {"git_commit": "abc"})
    words = " ".join(page.split())
    assert "commit abc: 50 flights of each case with the team estimator, and the first 10 of them" in words
    assert "seeds 2001 to 2050," in words
    lines = page.splitlines()
    (row,) = [line for line in lines if line.startswith("| title of drag | team |")]
    assert row.startswith("| title of drag | team | 49 of 50 | 0.0160 (0.0320) | - |")
    assert "| 1.0 | - |" in row
    below = lines[lines.index(row) + 1]
    assert below.startswith("|  | raw | 0 of 50 | - (-) |")
    assert "| title of drag | flights completed | 50 | 49 **missed** | 0 of 50 |" in lines
    assert "|  | formation, steady mean | at most 0.0160 m | 0.0160 m | - |" in lines


def test_cases_are_chosen_by_name() -> None:
    assert [each.name for each in choose(CASES, ["drag", NOMINAL])] == [NOMINAL, "drag"]
    assert choose(CASES, []) == list(CASES)
    with pytest.raises(ConfigError, match="--cases: unknown case 'moon', expected one of nominal, "):
        choose(CASES, ["moon"])


def test_scenario_of_a_case_is_relative_to_the_file(tmp_path: Path) -> None:
    file = tmp_path / "cases.yaml"
    file.write_text("variants: [{name: a, title: t, scenario: ../b.yaml, set: []}]")
    (found,) = load_variants(file)
    assert found.scenario == str(tmp_path.parent / "b.yaml")
    assert [each.scenario for each in by_estimator(found)] == [found.scenario] * 2
