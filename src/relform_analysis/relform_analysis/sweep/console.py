"""The results of a sweep as tables for people: every variant, and the formation error over a grid of two."""

from collections.abc import Iterable, Mapping, Sequence

from rich.console import Console
from rich.table import Table

from relform_analysis.flight.summary import Json
from relform_analysis.sweep.grid import short_keys, value_text

SHOWN = {
    "steady_mean_m": "formation (m)",
    "leader_steady_mean_m": "leader (m)",
    "leader_yaw_steady_mean_deg": "leader yaw (deg)",
    "rotor_std_rpm": "rotor std (rpm)",
    "step_ms_median": "step (ms)",
}
"""Metrics in the table; sweep.json has all."""
IN_GRID = "steady_mean_m"
"""The metric that is shown over a grid."""


def print_report(report: Json, console: Console) -> None:
    """Print the statistics of every variant, and why flights were lost."""
    console.print(_variants(report["variants"]))
    if (table := grid_table(report["variants"])) is not None:
        console.print(table)
    for variant in report["variants"]:
        for lost in variant["reasons"]:
            console.print(
                f"{variant['name']}, seed {lost['seed']}: {lost['outcome']}: {lost['reason']}",
                highlight=False,
            )


def _variants(variants: Sequence[Json]) -> Table:
    table = Table(title="mean (95 % confidence interval)", title_justify="left", box=None)
    table.add_column("variant", overflow="fold")
    table.add_column("completed", justify="right")
    for heading in SHOWN.values():
        table.add_column(heading, justify="right", no_wrap=True)
    for variant in variants:
        cells = [_cell(variant["metrics"].get(key)) for key in SHOWN]
        table.add_row(variant["name"], _completed(variant), *cells)
    return table


def _cell(metric: Json | None) -> str:
    if metric is None or metric["mean"] is None:
        return "-"
    interval = "" if metric["ci95"] is None else " ({:.3g} … {:.3g})".format(*metric["ci95"])
    return f"{metric['mean']:.3g}{interval}"


def _completed(variant: Mapping[str, int]) -> str:
    return f"{variant['completed']}/{variant['runs']}"


def grid_table(variants: Sequence[Json]) -> Table | None:
    """The steady formation error over a grid of two parameters; None for any other sweep."""
    keys = list(variants[0]["parameters"])
    if len(keys) != 2:
        return None
    words = short_keys(keys)
    values = [_distinct(value_text(variant["parameters"][key]) for variant in variants) for key in keys]
    cells = {
        tuple(value_text(variant["parameters"][key]) for key in keys): _grid_cell(variant)
        for variant in variants
    }
    title = "{}, mean: {} down, {} across".format(SHOWN[IN_GRID], *(words[key] for key in keys))
    table = Table(title=title, title_justify="left", box=None, min_width=len(title))
    table.add_column("")
    for value in values[1]:
        table.add_column(value, justify="right")
    for row in values[0]:
        table.add_row(row, *(cells[row, column] for column in values[1]))
    return table


def _distinct(texts: Iterable[str]) -> list[str]:
    return list(dict.fromkeys(texts))


def _grid_cell(variant: Json) -> str:
    metric = variant["metrics"].get(IN_GRID)
    mean = "-" if metric is None or metric["mean"] is None else f"{metric['mean']:.3g}"
    return mean if variant["completed"] == variant["runs"] else f"{mean} ({_completed(variant)} completed)"
