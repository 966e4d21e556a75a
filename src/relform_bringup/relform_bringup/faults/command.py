"""The command line of the fault campaign: fly the cases, several at the same time, and report."""

import argparse
import subprocess
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import as_completed
from contextlib import contextmanager
from pathlib import Path

from rich.console import Console

from relform_analysis.sweep.session import executor_for
from relform_bringup.faults.fly_case import fly_case
from relform_bringup.faults.kinds import KINDS
from relform_bringup.faults.plan import Case
from relform_bringup.faults.results import CAMPAIGN_FILE, Result, passed_before, store, summary, table
from relform_bringup.flight import check_installation
from relform_core.atomic_file import write_json_atomically
from relform_core.errors import ConfigError
from relform_core.exit_codes import EXIT_FAILURE
from relform_core.installed import software_versions
from relform_core.script import CommandParser, command, positive, print_error

CASES, FIRST_SEED, JOBS = 200, 1, 3
EPILOG = "Exit codes: 0 all cases passed, 1 one did not, 2 wrong usage or installation, 130 interrupted."


@command
def main(arguments: Sequence[str] | None = None) -> int:
    """Fly the campaign; returns the exit code."""
    options = _parser().parse_args(arguments)
    cases = _cases(options)
    check_installation(record=True, composed=False, visualize=True)
    versions = software_versions()
    commit = versions["git_commit"]
    console = Console()
    began = time.monotonic()
    results = {case: result for case in cases if (result := passed_before(options.out, case, commit))}
    for result in _flown([case for case in cases if case not in results], options):
        store(options.out, result, commit)
        results[result.case] = result
        _show(console, result, len(results), len(cases), time.monotonic() - began)
    kinds = list(KINDS)
    ordered = sorted(results.values(), key=lambda result: (kinds.index(result.kind), result.seed))
    wall = time.monotonic() - began
    write_json_atomically(options.out / CAMPAIGN_FILE, summary(ordered, wall, versions))
    console.print(table(ordered))
    console.print(f"{options.out / CAMPAIGN_FILE}, after {wall:.0f} s", soft_wrap=True, highlight=False)
    failed = [result for result in ordered if result.problems]
    for result in failed:
        print_error(f"{result.case}: {result.problems[0]}; again: scripts/faults.py --case {result.case}")
    return EXIT_FAILURE if failed else 0


def _flown(cases: Sequence[Case], options: argparse.Namespace) -> Iterator[Result]:
    """Fly cases, and give the result of each as it ends."""
    with _no_mount_left(options.out), executor_for(options.jobs, None) as executor:
        flying = {
            executor.submit(fly_case, case, options.out / f"{case.kind}-{case.seed}"): case for case in cases
        }
        yield from (future.result() for future in as_completed(flying))


@contextmanager
def _no_mount_left(folder: Path) -> Iterator[None]:
    """Release the small disks of flights that were interrupted."""
    try:
        yield
    finally:
        mounts = Path("/proc/mounts").read_text(encoding="utf-8").splitlines()
        for place in (line.split()[1] for line in mounts):
            if place.startswith(f"{folder.absolute()}/"):
                subprocess.run(["umount", "-l", place], check=False)


def _show(console: Console, result: Result, done: int, total: int, wall: float) -> None:
    verdict = "; ".join(result.problems) or "passed"
    line = f"{done:3} of {total}  {wall:4.0f} s  {result.case!s:24} {result.wall:5.1f} s  {verdict}"
    console.print(line, soft_wrap=True, highlight=False, markup=False)


def _cases(options: argparse.Namespace) -> list[Case]:
    """The cases to fly: those that are named, or some of each kind in turn.

    Raises:
        ConfigError: a kind is unknown, or a case is not written as KIND:SEED.
    """
    cases = [Case.parse(text) for text in options.case]
    for name in (*options.kinds, *(case.kind for case in cases)):
        if name not in KINDS:
            raise ConfigError(f"unknown kind '{name}', expected one of {', '.join(KINDS)}")
    if cases:
        return list(dict.fromkeys(cases))
    kinds = options.kinds or list(KINDS)
    return [Case(kinds[number % len(kinds)], options.first_seed + number) for number in range(options.cases)]


def _parser() -> CommandParser:
    parser = CommandParser(
        prog="faults",
        description="Do something to flights on the wall clock, and check what they do then; "
        "the same command continues after a stop.",
        epilog=EPILOG,
    )
    parser.add_argument(
        "--cases",
        type=positive,
        default=CASES,
        metavar="N",
        help=f"how many, of all kinds in turn ({CASES})",
    )
    parser.add_argument("--kinds", nargs="+", default=[], metavar="KIND", help="of these kinds only")
    parser.add_argument(
        "--case", nargs="+", default=[], metavar="KIND:SEED", help="fly these cases, as in kill-clock:17"
    )
    parser.add_argument(
        "--first-seed", type=int, default=FIRST_SEED, metavar="SEED", help=f"of the first case ({FIRST_SEED})"
    )
    parser.add_argument(
        "--jobs", type=positive, default=JOBS, metavar="N", help=f"flights at the same time ({JOBS})"
    )
    parser.add_argument(
        "--out",
        type=Path,
        default=Path("runs/faults"),
        metavar="DIR",
        help="folder (runs/faults)",
    )
    return parser
