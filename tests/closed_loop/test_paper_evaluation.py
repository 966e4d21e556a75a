"""The paper's evaluation with short flights: every file is written, and a second run resumes."""

import csv
import json
import re
from pathlib import Path

import pytest

from relform_analysis.evaluation import ablation_figure
from relform_analysis.evaluation.claims import compared_numbers, of_variant, targets, unkept
from relform_analysis.evaluation.command import main
from relform_analysis.evaluation.plan import FULL, plan_evaluation
from relform_analysis.plots import over_time as paper_plot
from relform_analysis.sweep.plan import load_variants
from relform_core.errors import ConfigError
from support.scenarios import PAPER, paper_scenario
from support.sweeps import BASE, files_of, short_phases

VARIANTS = PAPER.parents[1] / "sweeps/ablation.yaml"
TEAM = paper_scenario().config.team
FIGURES = (
    "trajectories_3d",
    "solver",
    "formation_errors",
    "tracking_errors",
    "rotor_speeds",
    "followers_and_view",
)


@pytest.fixture
def short_paper(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A scenario file of half a second."""
    for module in (paper_plot, ablation_figure):
        monkeypatch.setattr(module, "DPI", 30)
    file = tmp_path / "short.yaml"
    file.write_text(paper_scenario(short_phases(0.5)).effective_yaml)
    return file


def statistics(**means: float | None) -> dict[str, object]:
    kept = {target.key: 0.9 * target.bound / target.factor for target in targets(TEAM)}
    metrics = {key: {"mean": mean} for key, mean in {**kept, **means}.items()}
    return {"name": FULL, "runs": 50, "completed": 50, "metrics": metrics}


def test_from_flights_to_figures(
    short_paper: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    command = ["--scenario", str(short_paper), "--variants", str(VARIANTS), "--out", str(out),
               "--few", "1", "--many", "2", "--jobs", "2"]  # fmt: skip
    code = main(command)
    told = capsys.readouterr()

    variants = json.loads((out / "sweep.json").read_text())["variants"]
    assert {variant["name"]: variant["runs"] for variant in variants} == {
        variant.name: 2 if variant.name in ("full", "paper_tuning") else 1
        for variant in load_variants(VARIANTS)
    }
    missed = unkept(of_variant(variants, FULL), TEAM)
    assert code == (1 if missed else 0)
    assert [line.partition("missed: ")[2] for line in told.err.splitlines() if "missed: " in line] == missed

    for folder, names in (("figures", (*FIGURES, "ablation")), ("figures-paper-tuning", FIGURES)):
        assert {file.name for file in (out / folder).iterdir()} == {
            f"{name}.{kind}" for name in names for kind in ("png", "pdf")
        }
    with (out / "claims.csv").open(newline="") as stream:
        claims = {row["number"]: row for row in csv.DictReader(stream)}
    assert len(claims) == len(compared_numbers(TEAM))
    formation = claims["formation error, steady, mean"]
    assert formation["paper"] == "< 0.068 m"
    mean = of_variant(variants, FULL)["metrics"]["steady_mean_m"]["mean"]
    assert float(formation["default, 2 flights: mean"]) == mean
    assert formation["default, 1 flights: n"] == "1"
    with (out / "ablation.csv").open(newline="") as stream:
        assert [row["variant"] for row in csv.DictReader(stream)] == [v["name"] for v in variants]
    page = (out / "evaluation.md").read_text()
    assert page in told.out
    assert f"| formation error, steady, mean (m) | <= 0.068 | {mean:.4g}" in page
    for variant in variants:
        assert f"| {variant['title']} | {variant['completed']} of {variant['runs']} |" in page

    kept = files_of(out)
    assert main(command) == code
    assert files_of(out) == kept


def test_ablations_are_flown_as_often_as_the_paper_flew() -> None:
    runs = plan_evaluation(PAPER, load_variants(VARIANTS), few=10, many=50)
    seeds = {
        name: [run.seed for run in runs if run.variant == name] for name in {run.variant for run in runs}
    }
    assert seeds["full"] == seeds["paper_tuning"] == list(range(1, 51))
    assert all(seeds[name] == list(range(1, 11)) for name in seeds.keys() - {"full", "paper_tuning"})
    assert {run.variant for run in runs if run.keeps_log} == {
        "full", "cold", "paper_tuning", "paper_tuning_cold",
    }  # fmt: skip


def test_missing_variants_are_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(ConfigError, match="the variants lack 'full', which the evaluation needs"):
        plan_evaluation(PAPER, (BASE,), few=1, many=1)
    file = tmp_path / "variants.yaml"
    file.write_text("variants: [{name: full, title: t, set: []}]")
    assert main(["--scenario", str(PAPER), "--variants", str(file), "--out", str(tmp_path / "out")]) == 2
    expected = "error: the variants lack 'shift_only', which the evaluation needs\n"
    assert capsys.readouterr().err == expected


def test_missed_targets_are_listed() -> None:
    assert unkept(statistics(), TEAM) == []
    lost = statistics() | {"completed": 48}
    assert unkept(lost, TEAM) == ["2 of 50 flights not completed"]
    found = unkept(
        statistics(
            rotor_std_rpm=650.5, saturated_fraction=0.0501, leader_steady_mean_m=0.15, steady_mean_m=None
        ),
        TEAM,
    )
    assert found == [
        "formation error, steady, mean: unknown",
        "rotor speed, standard deviation: 650.5 rpm, must be at most 650",
        "steps with a rotor at its limit: 5.01 %, must be at most 5",
    ]
    one_pair = unkept(statistics(**{"pairs.follower_2.follower_1.steady_mean_m": 0.0751}), TEAM)
    assert [re.sub(r":.*", "", line) for line in one_pair] == ["follower_2 to follower_1"]
