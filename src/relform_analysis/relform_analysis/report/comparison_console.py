"""A comparison for people in a terminal."""

from rich.console import Console
from rich.table import Table

from relform_analysis.comparison.compare import Comparison
from relform_analysis.comparison.results import Result
from relform_analysis.report.console import plain_table

SAME_CONFIGURATION = "Configuration, seed and software are the same."
EQUAL = "Truth and commands are equal, bit for bit."


def print_comparison(comparison: Comparison, console: Console | None = None) -> None:
    """Print what differs, in configuration and in results, and what cannot be compared."""
    console = console or Console()
    if comparison.differences:
        console.print(_configuration(comparison))
    else:
        console.print(SAME_CONFIGURATION, highlight=False)
    if comparison.equal:
        console.print(EQUAL, highlight=False)
    console.print(_results(comparison))
    if comparison.limits:
        console.print("Not compared, or to be read with care:", highlight=False)
        for limit in comparison.limits:
            console.print(f"- {limit}", highlight=False, markup=False)


def _configuration(comparison: Comparison) -> Table:
    table = _table(comparison, "What differs in the configuration")
    for row in comparison.differences:
        table.add_row(_named(row.section, row.key), *row.values)
    return table


def _named(section: str, key: str) -> str:
    return key if key.startswith(section) else f"{section}: {key}"


def _results(comparison: Comparison) -> Table:
    common, first = comparison.common, comparison.flights[0].label
    table = _table(
        comparison,
        f"Results from {common.start:.2f} to {common.end:.2f} s",
        caption=f"In brackets: difference to {first}, and ratio.",
        justify="right",
    )
    for row in comparison.results:
        table.add_row(f"{row.label} ({row.unit})" if row.unit else row.label, *_cells(row))
    return table


def _cells(row: Result) -> list[str]:
    return [row.text(0), *(_compared(row, flight) for flight in range(1, len(row.values)))]


def _compared(row: Result, flight: int) -> str:
    if row.difference(flight) is None:
        return row.text(flight)
    ratio = "" if row.ratio(flight) is None else f", {row.ratio_text(flight)}"
    return f"{row.text(flight)} ({row.difference_text(flight)}{ratio})"


def _table(comparison: Comparison, title: str, caption: str | None = None, justify: str = "left") -> Table:
    table = plain_table(title, caption)
    table.add_column("")
    for flight in comparison.flights:
        table.add_column(flight.label, justify="right" if justify == "right" else "left", overflow="fold")
    return table
