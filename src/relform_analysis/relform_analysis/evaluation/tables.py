"""The evaluation in tables: claim by claim, variant by variant; as CSV, and as Markdown to read."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from relform_analysis.evaluation.claims import compared_numbers, mean_of, of_variant, pair_key, targets, worst
from relform_analysis.evaluation.plan import FULL, PAPER_TUNING
from relform_analysis.flight.paper_claims import FOOTNOTE, ComparedNumber
from relform_analysis.flight.summary import Json
from relform_analysis.flight.tracking_errors import scored_pairs
from relform_analysis.sweep.folder import write_table
from relform_analysis.sweep.statistics import aggregate
from relform_core.atomic_file import write_atomically
from relform_core.team_config import TeamConfig

CLAIMS, ABLATION, PAGE = "claims.csv", "ablation.csv", "evaluation.md"

Rows = Sequence[Mapping[str, Any]]


def write_tables(folder: Path, rows: Rows, report: Json, team: TeamConfig, few: int) -> str:
    """Write all tables, and return the page that holds them.

    Args:
        rows: of all flights.
        report: what is in sweep.json.
        few: number of flights in the column that has as many as the paper flew.
    Raises:
        RelformError: they cannot be written.
    """
    write_table(folder / CLAIMS, claim_rows(rows, team, few))
    write_table(folder / ABLATION, ablation_rows(report["variants"], team))
    page = "\n".join([
        "# The paper's evaluation, flown again",
        "",
        f"Written by `make paper` from commit {report['versions'].get('git_commit') or 'unknown'}.",
        "",
        "## Claim by claim",
        "",
        "Mean over the flights, in brackets the 95th percentile and the worst flight.",
        "",
        *_claims_page(rows, team, few),
        "",
        FOOTNOTE,
        "",
        "## Targets of the default tuning",
        "",
        *_targets_page(of_variant(report["variants"], FULL), team),
        "",
        "## What each part is worth",
        "",
        *_ablation_page(report["variants"], team),
        "",
    ])  # fmt: skip
    write_atomically(folder / PAGE, page)
    return page


def claim_rows(rows: Rows, team: TeamConfig, few: int) -> list[Json]:
    """A row per number: the paper's words, and its distribution in each group of flights."""
    groups = _groups(rows, few)
    table = []
    for number in compared_numbers(team):
        row: Json = {"number": number.label, "unit": number.unit, "paper": number.paper}
        for name, metrics in groups.items():
            distribution = metrics.get(number.key, {})
            for statistic in ("n", "mean", "std", "p95", "min", "max"):
                value = distribution.get(statistic)
                scaled = value if value is None or statistic == "n" else number.factor * value
                row[f"{name}: {statistic}"] = scaled
        table.append(row)
    return table


def ablation_rows(variants: Sequence[Json], team: TeamConfig) -> list[Json]:
    """A row per variant: the outcomes of its flights, and the mean of each number."""
    return [
        {
            "variant": variant["name"],
            "title": variant["title"],
            **{key: variant[key] for key in ("runs", "completed", "crashed", "failed")},
            **{
                f"{number.label} [{number.unit}]": None if mean is None else number.factor * mean
                for number in compared_numbers(team)
                for mean in [mean_of(variant, number.key)]
            },
        }
        for variant in variants
    ]


def _groups(rows: Rows, few: int) -> dict[str, Json]:
    """Statistics by name of a group of flights."""
    of = {name: [row for row in rows if row["variant"] == name] for name in (FULL, PAPER_TUNING)}
    default, paper = of[FULL], of[PAPER_TUNING]
    groups = {
        f"default, {min(few, len(default))} flights": default[:few],
        f"default, {len(default)} flights": default,
        f"paper's weights, {len(paper)} flights": paper,
    }
    return {name: aggregate(flights)["metrics"] for name, flights in groups.items()}


def _claims_page(rows: Rows, team: TeamConfig, few: int) -> list[str]:
    groups = _groups(rows, few)
    body = [
        [
            f"{number.label} ({number.unit})" if number.unit else number.label,
            number.paper,
            *(_cell(number, metrics.get(number.key)) for metrics in groups.values()),
        ]
        for number in compared_numbers(team)
    ]
    return _markdown(["", "the paper", *groups], body)


def _targets_page(variant: Json, team: TeamConfig) -> list[str]:
    body = [["flights completed", f"{variant['runs']}", f"{variant['completed']}"]]
    for target in targets(team):
        mean = mean_of(variant, target.key)
        found = "-" if mean is None else f"{target.factor * mean:.4g}"
        mark = "" if target.holds(mean) else " **missed**"
        body.append([f"{target.label} ({target.unit})", f"<= {target.bound:g}", found + mark])
    return _markdown(["mean over the flights", "wanted", "found"], body)


def _ablation_page(variants: Sequence[Json], team: TeamConfig) -> list[str]:
    known = {number.key: number for number in compared_numbers(team)}
    between_followers = [pair_key(*pair, "steady_mean_m") for pair in scored_pairs(team)[-1:]]
    shown = {
        "steady_mean_m": "formation error, steady (m)",
        **dict.fromkeys(between_followers, "of it between followers (m)"),
        "leader_steady_mean_m": "leader error, steady (m)",
        "follower_yaw_steady_mean_deg": "follower yaw, steady (deg)",
        "separation_min_m": "smallest separation (m)",
        "rotor_std_rpm": "rotor std (rpm)",
        "kkt_first_median": "KKT, first SQP step",
        "kkt_median": "KKT, last",
    }
    body = [
        [
            variant["title"],
            f"{variant['completed']} of {variant['runs']}",
            *(_mean(known[key], variant["metrics"].get(key)) for key in shown),
        ]
        for variant in variants
    ]
    return _markdown(["", "completed", *shown.values()], body)


def _cell(number: ComparedNumber, distribution: Json | None) -> str:
    if not distribution or distribution["mean"] is None:
        return "-"
    mean, p95, extreme = (number.bare(distribution[key]) for key in ("mean", "p95", worst(number)))
    return f"{mean} ({extreme})" if worst(number) == "min" else f"{mean} ({p95}, {extreme})"


def _mean(number: ComparedNumber, distribution: Json | None) -> str:
    if not distribution or distribution["mean"] is None:
        return "-"
    return number.bare(distribution["min" if worst(number) == "min" else "mean"])


def _markdown(head: Sequence[str], body: Sequence[Sequence[str]]) -> list[str]:
    rule = ["---"] + ["---:"] * (len(head) - 1)
    return [f"| {' | '.join(cells)} |" for cells in (head, rule, *body)]
