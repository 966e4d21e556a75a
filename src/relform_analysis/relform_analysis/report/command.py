"""The command line of ``scripts/report.py``."""

import sys
from collections.abc import Sequence
from pathlib import Path

from relform_analysis.comparison.compare import compare, comparison_json
from relform_analysis.report.comparison_console import print_comparison
from relform_analysis.report.comparison_page import write_comparison
from relform_analysis.report.comparison_source import read_flights
from relform_analysis.report.flight_page import write_flight_report
from relform_analysis.report.flight_source import unrecorded_topics
from relform_analysis.report.recorded_flight import read_flight
from relform_analysis.report.sweep_page import write_sweep_report
from relform_analysis.report.sweep_source import is_sweep, read_sweep
from relform_core.atomic_file import write_json_atomically
from relform_core.run_folder import CONFIG_FILE, PAPER_FIGURES, REPORT_FILE
from relform_core.script import CommandParser, command

COMPARISON_FILE = "comparison.html"


@command
def main(arguments: Sequence[str] | None = None) -> int:
    """Make the report of a flight or a sweep, or compare flights; returns 0, or 2 after an error."""
    parser = CommandParser(
        prog="report",
        description="Make the report of a flight or a sweep, or compare flights: one HTML file that opens "
        "offline.",
    )
    parser.add_argument(
        "sources",
        nargs="+",
        metavar="BAG|RUN|SWEEP|SWEEP:VARIANT",
        help="a bag (file or folder), the folder of a run or of a sweep; several flights are compared, where "
        "SWEEP:VARIANT is the first flight of a variant, and SWEEP:VARIANT-s7 the one with seed 7",
    )
    parser.add_argument(
        "--out",
        type=Path,
        metavar="FILE",
        help=f"the report (default: {REPORT_FILE} in that folder, of several {COMPARISON_FILE} here)",
    )
    parser.add_argument(
        "--no-figures",
        action="store_true",
        help=f"no PNG and PDF for papers in the folder {PAPER_FIGURES} beside it",
    )
    parser.add_argument(
        "--config",
        metavar="FILE",
        help=f"scenario of a bag, path or plain name (default: the attachment of the bag, else the "
        f"{CONFIG_FILE} beside it)",
    )
    parser.add_argument(
        "--json", type=Path, metavar="FILE", help="also write a comparison as JSON (docs/report.md)"
    )
    chosen = parser.parse_args(arguments)
    if len(chosen.sources) > 1:
        compare_flights(chosen.sources, chosen.out or Path(COMPARISON_FILE), chosen.config, chosen.json)
        return 0
    if chosen.json is not None:
        parser.error("--json is for a comparison of flights; the numbers of one are in its summary.json")
    source = Path(chosen.sources[0])
    folder = source if source.is_dir() else source.parent
    out: Path = chosen.out or folder / REPORT_FILE
    if is_sweep(source):
        write_sweep_report(out, read_sweep(source))
        print(out)
    else:
        report_flight(source, out, chosen.config, with_figures=not chosen.no_figures)
    return 0


def compare_flights(
    sources: Sequence[str], out: Path, configuration: Path | str | None, json_file: Path | None
) -> None:
    """Compare flights, print the tables, then the name of each file.

    Args:
        sources: a run, a bag, or ``SWEEP:VARIANT`` each.
        out: the page.
        configuration: as of ``report_flight``, of all bags.
        json_file: gets the comparison as JSON.
    Raises:
        RelformError: a source is no flight, or something cannot be written.
    """
    comparison = compare(read_flights(sources, configuration))
    print_comparison(comparison)
    write_comparison(out, comparison)
    print(out)
    if json_file is not None:
        write_json_atomically(json_file, comparison_json(comparison))
        print(json_file)


def report_flight(source: Path, out: Path, configuration: Path | str | None, with_figures: bool) -> None:
    """Make the report of a recorded flight, then its figures, and print the name of each file.

    Args:
        source: a bag or the folder of a run.
        out: the report.
        configuration: path or plain name of the scenario; None: as ``find_configuration`` finds it.
        with_figures: whether to draw figures for papers beside the report.
    Raises:
        RelformError: there is no flight, or something cannot be written.
    """
    flight = read_flight(source, configuration)
    write_flight_report(out, flight.log, flight.summary)
    if unrecorded := unrecorded_topics(flight.log):
        print(
            f"{flight.bag}: no message on {', '.join(unrecorded)}; left blank in the report", file=sys.stderr
        )
    print(out, flush=True)
    if with_figures:
        from relform_analysis.plots.paper_figures import (
            draw_paper_figures,  # matplotlib takes a second to import
        )

        for figure in draw_paper_figures([flight.log], out.parent / PAPER_FIGURES):
            print(figure)
