"""summary.json for people: the errors per phase, and the whole flight beside what the paper says."""

from rich import box
from rich.console import Console
from rich.table import Table

from relform_analysis.flight.paper_claims import FOOTNOTE
from relform_analysis.flight.summary import Json
from relform_analysis.report.compared_rows import compared_rows
from relform_analysis.report.error_rows import STATISTICS, error_columns, error_rows


def print_table(summary: Json, console: Console | None = None, *, with_paper: bool = True) -> None:
    """Print a summary; without colours and boxes where the output is no terminal.

    Args:
        summary: of the flight.
        with_paper: whether the paper's flight was flown: its numbers are shown beside.
    """
    console = console or Console()
    console.print(_phase_table(summary))
    console.print(_flight_table(summary, with_paper))


def _phase_table(summary: Json) -> Table:
    planned = summary["steps_planned"]
    table = plain_table(
        title=f"{summary['scenario']}, seed {summary['seed']}: {summary['outcome']}, "
        f"{summary['steps']} of {planned} control steps",
        caption=", ".join(f"{phase['name']} {phase['title']}" for phase in summary["phases"]),
    )
    table.add_column("")
    table.add_column("")
    for heading in error_columns(summary):
        table.add_column(heading, justify="right")
    for error in error_rows(summary):
        label = (*error.words, f"({error.unit})")
        for heading, statistic, cells in zip(label, STATISTICS, error.cells, strict=True):
            table.add_row(heading, statistic, *cells, end_section=statistic == STATISTICS[-1])
    return table


def _flight_table(summary: Json, with_paper: bool) -> Table:
    table = plain_table("Beside the paper", caption=FOOTNOTE) if with_paper else plain_table("In numbers")
    table.add_column("")
    table.add_column("this flight", justify="right")
    if with_paper:
        table.add_column("the paper says", justify="right")
    for row in compared_rows(summary, with_paper):
        table.add_row(row.label, row.value, *([row.paper] if with_paper else []))
    return table


def plain_table(title: str, caption: str | None = None) -> Table:
    """A table of a report: rules between its parts, nothing around it."""
    return Table(
        title=title,
        caption=caption,
        box=box.SIMPLE_HEAD,
        title_justify="left",
        caption_justify="left",
        pad_edge=False,
    )
