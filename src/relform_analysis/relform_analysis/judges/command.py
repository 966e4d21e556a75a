"""The command line of the bound: what the sensors allow, beside what the team estimator reaches."""

from collections.abc import Sequence

import numpy as np
from rich.console import Console
from rich.table import Table

from relform_analysis.judges.cramer_rao import ASSUMPTIONS, pair_bounds
from relform_analysis.judges.flown import FlownStep, fly
from relform_analysis.judges.linearised import pair_errors
from relform_controller.ocp.model import RigidBody
from relform_core.arrays import Array
from relform_core.load import load_scenario
from relform_core.script import CommandParser, command, positive

SETTLED_AFTER = 1.0
"""Time from the start until the start is forgotten [s]."""


@command
def main(arguments: Sequence[str] | None = None) -> int:
    """Fly, compute and print; returns the exit code, 2 if the scenario cannot be flown."""
    parser = CommandParser(
        prog="bound",
        description="The posterior Cramer-Rao bound of a flight, beside the errors of the team estimator.",
    )
    parser.add_argument("--scenario", default="paper", help="path or plain name (default: paper)")
    parser.add_argument("--seed", type=int, default=1, help="first seed (default 1)")
    parser.add_argument("--flights", type=positive, default=3, help="flights to average over (default 3)")
    parser.add_argument("--set", dest="overrides", action="append", default=[], metavar="KEY=VALUE")
    options = parser.parse_args(arguments)
    scenario = load_scenario(options.scenario, ["controller=team", *options.overrides], options.seed)
    config = scenario.config
    body, period = RigidBody.from_config(config.vehicle), config.controller.period
    flights = [fly(scenario.with_seed(options.seed + k)) for k in range(options.flights)]
    first = round(SETTLED_AFTER / period)
    table = Table(
        title=f"{config.name}: error of relative positions, root mean square of {len(flights)} flight(s)",
        title_justify="left",
        box=None,
    )
    table.add_column("")
    table.add_column("mm", justify="right")
    table.add_row("team estimator", _millimetres([_estimation_errors(steps)[first:] for steps in flights]))
    for assumption in ASSUMPTIONS:
        bounds = [pair_bounds(steps, body, period, assumption)[first:] for steps in flights]
        table.add_row(f"bound: {assumption.name}", _millimetres(bounds))
    Console().print(table)
    return 0


def _estimation_errors(steps: Sequence[FlownStep]) -> Array:
    """Distance between estimated and true position of each ordered pair [m], shape (steps, pairs)."""
    errors = np.array([pair_errors(step.estimate, step.states) for step in steps])
    return np.asarray(np.linalg.norm(errors, axis=-1))


def _millimetres(flights: Sequence[Array]) -> str:
    return f"{1e3 * np.sqrt(np.mean(np.concatenate(flights) ** 2)):.2f}"
