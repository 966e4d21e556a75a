"""The command line of the accuracy table: fly what is missing, case by case, and write the page."""

import argparse
import os
import sys
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console

from relform_analysis.accuracy.page import RAW, TEAM, Case, accuracy_page, verdicts
from relform_analysis.sweep.folder import SweepFolder
from relform_analysis.sweep.plan import load_variants, plan_runs
from relform_analysis.sweep.session import executor_for, fly_shown
from relform_analysis.sweep.variant import Variant
from relform_core.atomic_file import write_atomically
from relform_core.errors import ConfigError
from relform_core.exit_codes import EXIT_FAILURE
from relform_core.installed import software_versions
from relform_core.script import CommandParser, command, positive, print_error

CONTROLLERS = {RAW: "retuned", TEAM: "team"}
"""The controller file of each estimator, the same in all cases."""
FIRST_SEED, SEEDS = 2001, 50
"""Seeds that nothing was tuned on."""
RAW_SEEDS = 10
"""Raw feedback is flown for comparison only."""
PAGE = "accuracy.md"


@command
def main(arguments: Sequence[str] | None = None) -> int:
    """Fly the table; returns 0, 1 if a target is missed, 2 if it cannot be flown, 130 if interrupted."""
    options = _parser().parse_args(arguments)
    seeds = range(options.first_seed, options.first_seed + options.seeds)
    try:
        cases = fly_cases(options, seeds)
    except KeyboardInterrupt:
        print("\ninterrupted; finished flights are kept, the same command continues", file=sys.stderr)
        raise
    page = accuracy_page(cases, seeds, options.raw_seeds, software_versions())
    write_atomically(options.out / PAGE, page)
    print(page)
    print(options.out / PAGE)
    missed = [verdict.line for verdict in verdicts(cases) if not verdict.is_met]
    for line in missed:
        print_error(f"target missed: {line}")
    return EXIT_FAILURE if missed else 0


def fly_cases(options: argparse.Namespace, seeds: range) -> list[Case]:
    """Fly the chosen cases, each into a folder of its own, which is a sweep of two variants.

    Raises:
        ConfigError: a case does not exist or cannot be flown; found before the first flight.
        RelformError: a result cannot be stored.
    """
    chosen = choose(load_variants(options.variants), options.cases)
    plans = []
    for case in chosen:
        runs = plan_runs(options.scenario, by_estimator(case), (), seeds)
        in_both = seeds[: options.raw_seeds]
        plans.append((case, [run for run in runs if run.variant == TEAM or run.seed in in_both]))
    console = Console(stderr=True)
    cases = []
    with executor_for(options.jobs, options.scheduler) as executor:
        for number, (case, runs) in enumerate(plans, start=1):
            with SweepFolder(options.out / case.name) as folder:
                title = f"{case.name} ({number} of {len(plans)})"
                rows = fly_shown(runs, folder, executor, console, title)
                scenario = case.scenario or options.scenario
                report = folder.conclude(scenario, (), by_estimator(case), rows, software_versions())
            statistics = {variant["name"]: variant for variant in report["variants"]}
            cases.append(Case(case.name, case.title, statistics[RAW], statistics[TEAM]))
    return cases


def choose(cases: Sequence[Variant], names: Sequence[str]) -> list[Variant]:
    """The named cases, in their order; without names all.

    Raises:
        ConfigError: a name is unknown.
    """
    known = [case.name for case in cases]
    for name in names:
        if name not in known:
            raise ConfigError(f"--cases: unknown case '{name}', expected one of {', '.join(known)}")
    return [case for case in cases if case.name in names or not names]


def by_estimator(case: Variant) -> list[Variant]:
    """A case with each estimator."""
    return [
        Variant(
            name=name,
            title=f"{case.title}, {name}",
            scenario=case.scenario,
            set=(f"controller={controller}", *case.set),
        )
        for name, controller in CONTROLLERS.items()
    ]


def _parser() -> CommandParser:
    parser = CommandParser(
        prog="accuracy", description="Fly the accuracy table, raw beside team, without ROS; resumable."
    )
    parser.add_argument("--scenario", default="paper", help="path or plain name (default: paper)")
    parser.add_argument("--variants", default="accuracy", help="file of the cases (default: accuracy)")
    parser.add_argument(
        "--cases", nargs="+", default=[], metavar="CASE", help="fly only these (default: all)"
    )
    parser.add_argument(
        "--seeds", type=positive, default=SEEDS, help=f"flights of a case with team (default {SEEDS})"
    )
    parser.add_argument(
        "--raw-seeds", type=positive, default=RAW_SEEDS, help=f"and with raw (default {RAW_SEEDS})"
    )
    parser.add_argument("--first-seed", type=int, default=FIRST_SEED, help=f"(default {FIRST_SEED})")
    parser.add_argument("--out", type=Path, default=Path("runs/accuracy"), help="folder of the results")
    parser.add_argument(
        "--jobs", type=positive, default=os.cpu_count() or 1, help="processes (default: one per core)"
    )
    parser.add_argument("--scheduler", metavar="ADDRESS", help="fly on this Dask cluster instead")
    return parser
