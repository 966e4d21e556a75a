"""The command line of the evaluation: fly the missing runs, draw the figures, print the results."""

import argparse
import os
import sys
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console

from relform_analysis.evaluation.claims import of_variant, unkept
from relform_analysis.evaluation.figures import draw_evaluation
from relform_analysis.evaluation.plan import COLD, FEW, FULL, MANY, PAPER_TUNING, plan_evaluation
from relform_analysis.evaluation.tables import PAGE, write_tables
from relform_analysis.flight.log import FlightLog
from relform_analysis.sweep.folder import SWEEP_FILE, SweepFolder
from relform_analysis.sweep.plan import Run, load_variants
from relform_analysis.sweep.session import executor_for, fly_shown
from relform_core.errors import RelformError
from relform_core.exit_codes import EXIT_FAILURE
from relform_core.installed import software_versions
from relform_core.script import CommandParser, command, positive, print_error

FIGURES = {FULL: "figures", PAPER_TUNING: "figures-paper-tuning"}
"""Folder of the figures of each tuning."""


@command
def main(arguments: Sequence[str] | None = None) -> int:
    """Run the evaluation; returns 0, 1 if a target is missed, 2 if it cannot be done, 130 if interrupted."""
    options = _parser().parse_args(arguments)
    try:
        page, missed = evaluate(options)
    except KeyboardInterrupt:
        print("\ninterrupted; the same command continues from there", file=sys.stderr)
        raise
    print(page)
    print(f"All of it is in {options.out}: {PAGE}, tables, {', '.join(FIGURES.values())}.")
    for line in missed:
        print_error(f"target missed: {line}")
    return EXIT_FAILURE if missed else 0


def evaluate(options: argparse.Namespace) -> tuple[str, list[str]]:
    """The page with all tables, and the targets that the default tuning misses.

    Raises:
        RelformError: something cannot be flown or written.
    """
    variants = load_variants(options.variants)
    runs = plan_evaluation(options.scenario, variants, options.few, options.many)
    with (
        SweepFolder(options.out) as folder,
        executor_for(options.jobs, options.scheduler) as executor,
    ):
        rows = fly_shown(runs, folder, executor, Console(stderr=True))
        report = folder.conclude(options.scenario, (), variants, rows, software_versions())
        finished = {(row["variant"], row["seed"]) for row in rows if row["outcome"] != "failed"}
        logs = _logs(folder, [run for run in runs if (run.variant, run.seed) in finished])
    team = runs[0].scenario.config.team
    page = write_tables(options.out, rows, report, team, options.few)
    for tuning, name in FIGURES.items():
        draw_evaluation(options.out / name, logs, report["variants"], tuning)
    return page, unkept(of_variant(report["variants"], FULL), team)


def _logs(folder: SweepFolder, runs: Sequence[Run]) -> dict[str, list[FlightLog]]:
    logs: dict[str, list[FlightLog]] = {name: [] for name in (*COLD, *COLD.values())}
    for run in runs:
        if run.keeps_log:
            logs[run.variant].append(folder.log(run))
    for name, flights in logs.items():
        if not flights:
            raise RelformError(f"no flight of '{name}' could be flown; {folder.path / SWEEP_FILE} says why")
    return logs


def _parser() -> CommandParser:
    parser = CommandParser(
        prog="paper", description="Fly the paper's evaluation and redraw its figures; resumable."
    )
    parser.add_argument("--scenario", default="paper", help="path or plain name (default: paper)")
    parser.add_argument("--variants", default="ablation", help="path or plain name (default: ablation)")
    parser.add_argument(
        "--out", type=Path, default=Path("runs/paper-evaluation"), help="folder of the results"
    )
    parser.add_argument(
        "--jobs", type=positive, default=os.cpu_count() or 1, help="processes (default: one per core)"
    )
    parser.add_argument("--scheduler", metavar="ADDRESS", help="fly on this Dask cluster instead")
    parser.add_argument("--few", type=positive, default=FEW, help=f"seeds of each ablation (default {FEW})")
    parser.add_argument("--many", type=positive, default=MANY, help=f"seeds of each tuning (default {MANY})")
    return parser
