"""The command line of ``scripts/report.py``."""

import sys
from collections.abc import Sequence
from pathlib import Path

from relform_analysis.flight.metrics import flight_metrics
from relform_analysis.flight.summary import build_summary
from relform_analysis.report.flight_page import write_flight_report
from relform_analysis.report.flight_source import (
    ending_from_log,
    ending_from_run,
    unrecorded_topics,
    versions_from_bag,
)
from relform_analysis.report.sweep_page import write_sweep_report
from relform_analysis.report.sweep_source import is_sweep, read_sweep
from relform_analysis.sweep.folder import RUNS, SWEEP_FILE
from relform_bags.reader import find_bag
from relform_core.errors import BagError
from relform_core.run_folder import CONFIG_FILE, PAPER_FIGURES, REPORT_FILE
from relform_core.script import CommandParser, command


@command
def main(arguments: Sequence[str] | None = None) -> int:
    """Make the report of a flight or a sweep; returns 0, or 2 after an error."""
    parser = CommandParser(
        prog="report",
        description="Make the report of a flight or a sweep: one HTML file that opens offline.",
    )
    parser.add_argument(
        "source",
        type=Path,
        metavar="BAG|RUN|SWEEP",
        help="a bag (file or folder), the folder of a run, or the folder of a sweep",
    )
    parser.add_argument(
        "--out", type=Path, metavar="FILE", help=f"the report (default: {REPORT_FILE} in that folder)"
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
    chosen = parser.parse_args(arguments)
    folder = chosen.source if chosen.source.is_dir() else chosen.source.parent
    out: Path = chosen.out or folder / REPORT_FILE
    if is_sweep(chosen.source):
        write_sweep_report(out, read_sweep(chosen.source))
        print(out)
    else:
        report_flight(chosen.source, out, chosen.config, with_figures=not chosen.no_figures)
    return 0


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
    try:
        file = find_bag(source)
    except BagError as error:
        neither = f", and no sweep: there is no {SWEEP_FILE} in it" if source.is_dir() else ""
        if (source / RUNS).is_dir():
            neither += "; run the command of the sweep again, it continues and writes one"
        raise BagError(f"{error}{neither}") from None
    # Reading serialized messages needs ROS; sweeps do without.
    from relform_analysis.flight.from_bag import read_flight_log

    log = read_flight_log(file, configuration)
    ending, versions = ending_from_run(source) or (ending_from_log(log), versions_from_bag(file))
    write_flight_report(out, log, build_summary(log.scenario, flight_metrics(log), ending, versions))
    if unrecorded := unrecorded_topics(log):
        print(f"{file}: no message on {', '.join(unrecorded)}; left blank in the report", file=sys.stderr)
    print(out, flush=True)
    if with_figures:
        from relform_analysis.plots.paper_figures import (
            draw_paper_figures,  # matplotlib takes a second to import
        )

        for figure in draw_paper_figures([log], out.parent / PAPER_FIGURES):
            print(figure)
