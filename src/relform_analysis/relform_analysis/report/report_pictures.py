"""The pictures of reports in docs/images: of a flight, of flights side by side, and of a sweep."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

from relform_analysis.comparison.compare import compare
from relform_analysis.comparison.flights import ComparedFlight
from relform_analysis.flight.simulate import fly_in_process
from relform_analysis.report.comparison_page import write_comparison
from relform_analysis.report.flight_page import write_flight_report
from relform_analysis.report.flight_source import summary_of
from relform_analysis.report.screenshot import take
from relform_analysis.report.sweep_page import write_sweep_report
from relform_analysis.report.sweep_source import read_sweep
from relform_analysis.sweep.command import main as sweep
from relform_core.errors import RelformError
from relform_core.load import load_scenario
from relform_core.script import CommandParser, command

IMAGES = Path("docs/images")
SIZES_PX = {"flight": (1366, 900), "comparison": (1680, 1560), "sweep": (1366, 900)}
"""Width and height of the window, by the name of the report."""
SHOWN_AT = 12.0
"""Time of the flight that the pictures show [s]."""
SEED = 1


@command
def main(arguments: Sequence[str] | None = None) -> int:
    """Fly, make the reports and photograph them; returns the exit code."""
    parser = CommandParser(
        prog="report_pictures",
        description="Make the pictures of reports in the documentation, with Chromium.",
    )
    parser.add_argument(
        "--out",
        type=Path,
        default=IMAGES,
        metavar="FOLDER",
        help=f"folder of the pictures (default {IMAGES})",
    )
    out: Path = parser.parse_args(arguments).out
    with TemporaryDirectory() as folder:
        for name, report in _reports(Path(folder)):
            picture = out / f"report_{name}.png"
            width, height = SIZES_PX[name]
            take(report, picture, width, height, time=None if name == "sweep" else SHOWN_AT)
            print(picture, flush=True)
    return 0


def _reports(folder: Path) -> Iterator[tuple[str, Path]]:
    """Name and file of each kind of report."""
    flights = [
        _flown("team estimator", "controller=team"),
        _flown("raw feedback", "controller=retuned"),
        _flown("cold start", "controller=retuned", "controller.solver.sqp_steps_max=1"),
    ]
    first = flights[0]
    write_flight_report(folder / "flight.html", first.log, first.summary)
    yield "flight", folder / "flight.html"
    write_comparison(folder / "comparison.html", compare(flights))
    yield "comparison", folder / "comparison.html"
    code = sweep(
        ["--scenario", "paper", "--variants", "weights", "--runs", "2", "--out", str(folder / "sweep")]
    )
    if code:
        raise RelformError("the sweep of the pictures was not flown")
    write_sweep_report(folder / "sweep.html", read_sweep(folder / "sweep"))
    yield "sweep", folder / "sweep.html"


def _flown(label: str, *overrides: str) -> ComparedFlight:
    log = fly_in_process(load_scenario("paper", overrides, SEED))
    return ComparedFlight(label, label, log, summary_of(log))
