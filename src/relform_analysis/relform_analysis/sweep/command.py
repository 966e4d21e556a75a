"""The command line of a sweep: its options, its progress and its results."""

import argparse
import os
import sys
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console

from relform_analysis.flight.summary import Outcome
from relform_analysis.sweep.console import print_report
from relform_analysis.sweep.folder import SWEEP_FILE, TABLE, SweepFolder
from relform_analysis.sweep.grid import grid_variants, parse_grid
from relform_analysis.sweep.plan import load_variants, plan_runs
from relform_analysis.sweep.session import executor_for, fly_shown
from relform_analysis.sweep.variant import Variant
from relform_core.exit_codes import EXIT_FAILURE
from relform_core.installed import software_versions
from relform_core.script import CommandParser, command, positive

DEFAULT_VARIANT = Variant(name="default", title="the scenario", set=())


@command
def main(arguments: Sequence[str] | None = None) -> int:
    """Run a sweep; returns the exit code: 0 flown, 1 every run failed, 2 cannot be flown, 130 interrupted."""
    options = _parser().parse_args(arguments)
    console = Console(stderr=True)
    try:
        variants = _variants(options)
        seeds = range(options.seed, options.seed + options.runs)
        runs = plan_runs(options.scenario, variants, options.overrides, seeds)
        with (
            SweepFolder(options.out) as folder,
            executor_for(options.jobs, options.scheduler) as executor,
        ):
            console.print(_size(len(variants), len(seeds)), highlight=False)
            rows = fly_shown(runs, folder, executor, console)
            report = folder.conclude(options.scenario, options.overrides, variants, rows, software_versions())
    except KeyboardInterrupt:
        print("\ninterrupted; finished runs are kept, the same command continues from there", file=sys.stderr)
        raise
    print_report(report, Console(width=None if sys.stdout.isatty() else 160))
    print(f"{folder.path / SWEEP_FILE}, {folder.path / TABLE}")
    return 0 if any(row["outcome"] != Outcome.FAILED for row in rows) else EXIT_FAILURE


def _variants(options: argparse.Namespace) -> tuple[Variant, ...]:
    if options.grid:
        return grid_variants(parse_grid(options.grid))
    return load_variants(options.variants) if options.variants else (DEFAULT_VARIANT,)


def _size(variants: int, seeds: int) -> str:
    parts = ((variants, "variant"), (seeds, "seed"), (variants * seeds, "flight"))
    return "{} with {} each: {}".format(*(f"{n} {noun}" if n == 1 else f"{n} {noun}s" for n, noun in parts))


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
    compared = parser.add_mutually_exclusive_group()
    compared.add_argument(
        "--variants", metavar="FILE", help="path or plain name of the variants, or of the grid, to compare"
    )
    compared.add_argument(
        "--grid",
        action="append",
        default=[],
        metavar="KEY=VALUE,VALUE",
        help="compare all values of a key; several --grid: all combinations",
    )
    parser.add_argument(
        "--out", type=Path, required=True, help="folder of the results; an unfinished sweep continues"
    )
    parser.add_overrides("change a key, in all variants")
    return parser
