"""Benchmark: the SQP step for several team sizes, beside acados, in one interleaved run."""

import argparse
import json
import multiprocessing
import platform
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from relform_analysis.bench.acados_package import AGE
from relform_analysis.bench.compare import CONSTRAINTS, Setup, measure
from relform_analysis.bench.page import write_page
from relform_core.atomic_file import write_atomically
from relform_core.script import CommandParser, command, positive

Row = Mapping[str, Any]


@command
def main(arguments: Sequence[str] | None = None) -> int:
    """Measure and print; returns the exit code."""
    parser = CommandParser(
        prog="bench_solver",
        description="Measure the SQP step on recorded flights, in turns with acados. Times are those of the "
        "compiled code, by internal timers on both sides.",
    )
    parser.add_argument(
        "--vehicles", type=_team_size, nargs="+", default=[3, 5, 8, 12], help="team sizes (3 5 8 12)"
    )
    parser.add_argument(
        "--constrained",
        type=_team_size,
        nargs="*",
        default=[3, 5, 8],
        help="team sizes to measure with soft constraints, too (3 5 8)",
    )
    parser.add_argument("--peer", choices=("acados", "none"), default="acados", help="default: acados")
    parser.add_argument("--controller", default="retuned", help="tuning that is flown (default: retuned)")
    parser.add_argument("--set", dest="overrides", action="append", default=[], metavar="KEY=VALUE")
    parser.add_argument("--instances", type=positive, default=250, help="SQP steps per team (default 250)")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the figures to this file")
    parser.add_argument("--page", type=Path, metavar="FOLDER", help="write performance.md and its plot there")
    options = parser.parse_args(arguments)
    figures = {
        "machine": machine(),
        "peer": AGE if options.peer == "acados" else None,
        "rows": [_measured(options, n, ()) for n in options.vehicles],
        "constrained_rows": [_measured(options, n, (CONSTRAINTS,)) for n in options.constrained],
    }
    if options.json is not None:
        write_atomically(options.json, json.dumps(figures, indent=2) + "\n")
    if options.page is not None:
        write_page(options.page, figures)
    _print(figures)
    return 0


def _measured(options: argparse.Namespace, n_vehicles: int, constraints: Sequence[str]) -> Row:
    overrides = [*constraints, *options.overrides]
    setup = Setup(n_vehicles, options.controller, overrides, options.instances, options.peer == "acados")
    # A process of its own: memory and libraries of one team do not disturb the next one.
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as pool:
        return pool.submit(measure, setup).result()


def machine() -> str:
    """The processor and the number of its cores."""
    names = [
        line.partition(":")[2].strip()
        for line in Path("/proc/cpuinfo").read_text().splitlines()
        if line.startswith("model name")
    ]
    return f"{names[0]}, {len(names)} cores" if names else platform.machine()


def _team_size(text: str) -> int:
    if (number := int(text)) < 2:
        raise argparse.ArgumentTypeError(f"must be at least 2, not {number}")
    return number


def _print(figures: Mapping[str, Any]) -> None:
    console = Console(width=110)
    console.print(_table("One SQP step (ms): median, 99%, most", figures["rows"]))
    if constrained := figures["constrained_rows"]:
        console.print(_table("With soft constraints", constrained))
    for row in (*figures["rows"], *constrained):
        if "peer_missing" in row:
            console.print(f"{row['vehicles']} vehicles: acados skipped: {row['peer_missing']}")
    if figures["peer"]:
        console.print(f"acados: {figures['peer']}")


def _table(title: str, rows: Sequence[Row]) -> Table:
    table = Table(title=title, title_justify="left", box=None)
    headings = ("vehicles", "relform", "prepare", "feedback", "Python", "acados", "ratio", "of most")
    for heading in headings:
        table.add_column(heading, justify="right")
    for row in rows:
        both = "peer_ms" in row
        table.add_row(
            str(row["vehicles"]),
            _three(row["ours_ms"]),
            *(f"{row[name]['median']:.3f}" for name in ("ours_prepare_ms", "ours_feedback_ms")),
            f"{row['ours_python_ms']['median']:.3f}",
            _three(row["peer_ms"]) if both else "-",
            *((f"{row['ratio_median']:.1f}", f"{row['ratio_max']:.1f}") if both else ("-", "-")),
        )
    return table


def _three(times: Mapping[str, float]) -> str:
    return " ".join(f"{times[name]:.3f}" for name in ("median", "p99", "max"))
