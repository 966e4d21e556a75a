"""summary.json for people: the errors per phase, and the whole flight beside what the paper says."""

from collections.abc import Sequence

from rich import box
from rich.console import Console
from rich.table import Table

from relform_tools.paper_claims import COMPARED, FOOTNOTE
from relform_tools.summary import Json

STATISTICS = ("mean", "p95", "max")
NONE = "-"


def print_table(summary: Json, console: Console | None = None) -> None:
    """Print a summary; without colours and boxes where the output is no terminal."""
    console = console or Console()
    console.print(_phase_table(summary))
    console.print(_flight_table(summary))


def _phase_table(summary: Json) -> Table:
    phases = summary["phases"]
    planned = summary["steps_planned"]
    table = _table(
        title=f"{summary['scenario']}, seed {summary['seed']}: {summary['outcome']}, "
        f"{summary['steps']} of {planned} control steps",
        caption=", ".join(f"{phase['name']} {phase['title']}" for phase in phases),
    )
    table.add_column("")
    table.add_column("")
    for heading in (*(phase["name"] for phase in phases), "all", "steady"):
        table.add_column(heading, justify="right")
    for index, pair in enumerate(summary["pairs"]):
        label = (f"{pair['observer']} ->", pair["target"], "(m)")
        _add_rows(table, label, [phase["pairs"][index] for phase in phases], pair, "", "m")
    _add_rows(table, ("leader", "position", "(m)"), phases, summary, "leader_", "m")
    _add_rows(table, ("leader", "yaw", "(deg)"), phases, summary, "leader_yaw_", "deg")
    return table


def _add_rows(
    table: Table, label: tuple[str, str, str], phases: Sequence[Json], flight: Json, prefix: str, unit: str
) -> None:
    """Mean, 95th percentile and maximum: in each phase, in the whole flight, in its steady windows."""
    digits = 3 if unit == "m" else 1
    for heading, statistic in zip(label, STATISTICS, strict=True):
        values = [phase[f"{prefix}{statistic}_{unit}"] for phase in phases]
        values += [flight[f"{prefix}{statistic}_{unit}"], flight[f"{prefix}steady_{statistic}_{unit}"]]
        cells = [_number(value, digits) for value in values]
        table.add_row(heading, statistic, *cells, end_section=statistic == STATISTICS[-1])


def _flight_table(summary: Json) -> Table:
    table = _table("Beside the paper", caption=FOOTNOTE)
    table.add_column("")
    table.add_column("this flight", justify="right")
    table.add_column("the paper says", justify="right")
    for row in COMPARED:
        table.add_row(row.label, row.text(summary[row.key]), row.paper)
    return table


def _table(title: str, caption: str | None = None) -> Table:
    return Table(
        title=title,
        caption=caption,
        box=box.SIMPLE_HEAD,
        title_justify="left",
        caption_justify="left",
        pad_edge=False,
    )


def _number(value: float | None, digits: int) -> str:
    return NONE if value is None else f"{value:.{digits}f}"
