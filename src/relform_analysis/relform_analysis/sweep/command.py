"""The command line of a sweep: its options, its progress and its results."""

import os
import sys
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console
from rich.table import Table

from relform_analysis.flight.summary import Json, Outcome
from relform_analysis.sweep.folder import SWEEP_FILE, TABLE, SweepFolder
from relform_analysis.sweep.plan import Variant, load_variants, plan_runs
from relform_analysis.sweep.session import executor_for, fly_shown
from relform_core.exit_codes import EXIT_FAILURE
from relform_core.installed import software_versions
from relform_core.script import CommandParser, command, positive

DEFAULT_VARIANT = Variant(name="default", title="the scenario", set=())
SHOWN = {
    "steady_mean_m": "formation (m)",
    "leader_steady_mean_m": "leader (m)",
    "leader_yaw_steady_mean_deg": "leader yaw (deg)",
    "rotor_std_rpm": "rotor std (rpm)",
    "step_ms_median": "step (ms)",
}
"""Metrics in the table that a sweep prints at its end; sweep.json has all."""


@command
def main(arguments: Sequence[str] | None = None) -> int:
    """Run a sweep; returns the exit code: 0 flown, 1 every run failed, 2 cannot be flown, 130 interrupted."""
    options = _parser().parse_args(arguments)
    console = Console(stderr=True)
    try:
        variants = load_variants(options.variants) if options.variants else (DEFAULT_VARIANT,)
        seeds = range(options.seed, options.seed + options.runs)
        runs = plan_runs(options.scenario, variants, options.overrides, seeds)
        with (
            SweepFolder(options.out) as folder,
            executor_for(options.jobs, options.scheduler) as executor,
        ):
            rows = fly_shown(runs, folder, executor, console)
            report = folder.conclude(options.scenario, options.overrides, variants, rows, software_versions())
    except KeyboardInterrupt:
        print("\ninterrupted; finished runs are kept, the same command continues from there", file=sys.stderr)
        raise
    _print_report(report, Console(width=None if sys.stdout.isatty() else 160))
    print(f"{folder.path / SWEEP_FILE}, {folder.path / TABLE}")
    return 0 if any(row["outcome"] != Outcome.FAILED for row in rows) else EXIT_FAILURE


def _parser() -> CommandParser:
    parser = CommandParser(prog="sweep", description="Fly a scenario many times, without ROS, in parallel.")
    parser.add_argument("--scenario", required=True, help="path or plain name of the scenario, such as paper")
    parser.add_argument("--runs", type=positive, default=10, help="seeds per variant (default 10)")
    parser.add_argument("--seed", type=int, default=1, help="first seed (default 1)")
    parser.add_argument(
        "--jobs", type=positive, default=os.cpu_count() or 1, help="processes (default: one per core)"
    )
    parser.add_argument(
        "--scheduler", metavar="ADDRESS", help="fly on this Dask cluster instead (needs distributed)"
    )
    parser.add_argument("--variants", metavar="FILE", help="path or plain name of the variants to compare")
    parser.add_argument(
        "--out", type=Path, required=True, help="folder of the results; an unfinished sweep continues"
    )
    parser.add_argument(
        "--set",
        dest="overrides",
        action="append",
        default=[],
        metavar="KEY=VALUE",
        help="change a key, in all variants",
    )
    return parser


def _print_report(report: Json, console: Console) -> None:
    table = Table(
        title="mean ± half of its 95 % confidence interval (worst run)", title_justify="left", box=None
    )
    table.add_column("variant", no_wrap=True)
    table.add_column("completed", justify="right")
    for heading in SHOWN.values():
        table.add_column(heading, justify="right", no_wrap=True)
    for variant in report["variants"]:
        cells = [_cell(variant["metrics"].get(key)) for key in SHOWN]
        table.add_row(variant["name"], f"{variant['completed']}/{variant['runs']}", *cells)
    console.print(table)
    for variant in report["variants"]:
        for lost in variant["reasons"]:
            console.print(
                f"{variant['name']}, seed {lost['seed']}: {lost['outcome']}: {lost['reason']}",
                highlight=False,
            )


def _cell(metric: Json | None) -> str:
    if metric is None or metric["mean"] is None:
        return "-"
    spread = "" if metric["ci95"] is None else f" ± {metric['ci95'][1] - metric['mean']:.2g}"
    return f"{metric['mean']:.3g}{spread} ({metric['max']:.3g})"
