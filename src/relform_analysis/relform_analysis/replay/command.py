"""The command line of a counterfactual replay; exits like diff(1): 0 equal, 1 different, 2 error."""

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from rich.console import Console
from rich.table import Table

from relform_core.exit_codes import EXIT_FAILURE, EXIT_USAGE
from relform_core.run_folder import CONFIG_FILE
from relform_core.script import CommandParser, command
from relform_core.units import rad_s_to_rpm

if TYPE_CHECKING:
    from relform_analysis.replay.replay import Replay

EQUAL, DIFFERENT, TROUBLE = 0, EXIT_FAILURE, EXIT_USAGE


@command
def main(arguments: Sequence[str] | None = None) -> int:
    """Replay a bag; returns the exit code."""
    options = _parser().parse_args(arguments)
    # ROS and CasADi take a second to import, and the help does without them.
    from relform_analysis.flight.archive import write_kept_flight
    from relform_analysis.flight.log_builder import FlightLogBuilder
    from relform_analysis.replay.from_bag import read_recorded_flight
    from relform_analysis.replay.replay import replay

    overrides = [f"controller={options.controller}"] if options.controller else []
    flight = read_recorded_flight(options.bag, options.config)
    overrides += options.overrides
    scenario = flight.configuration.load(overrides)
    log = FlightLogBuilder(scenario) if options.out else None
    result = replay(flight, scenario, log)
    if log is not None:
        from relform_analysis.flight.from_bag import read_ground_truth

        read_ground_truth(flight.configuration.bag, log, scenario.config)
        write_kept_flight(options.out, log.build())
    if flight.gap is not None:
        print(f"{options.bag}: the replay ends early: {flight.gap}", file=sys.stderr)
    if options.plot:
        from relform_analysis.replay.figure import draw_replay  # matplotlib takes a second to import

        draw_replay(result, scenario.config.vehicle, options.plot)
    _print(result, Console(width=None if sys.stdout.isatty() else 120))
    return EQUAL if result.identical else DIFFERENT


def _parser() -> CommandParser:
    parser = CommandParser(
        prog="replay",
        description="Feed the measurements of a recorded flight to the controller of today, or to another, "
        "and compare its commands with the recorded ones. Exit code: 0 if all commands are equal, 1 if some "
        "differ, 2 if the bag or an option cannot be used.",
    )
    parser.add_argument("bag", type=Path, metavar="BAG", help="bag, or folder of a run")
    parser.add_argument(
        "--config",
        metavar="FILE",
        help=f"scenario that was flown, path or plain name (default: the attachment of the bag, else the "
        f"{CONFIG_FILE} beside it)",
    )
    parser.add_argument("--controller", type=Path, metavar="FILE", help="another controller configuration")
    parser.add_argument(
        "--set", dest="overrides", action="append", default=[], metavar="KEY=VALUE", help="change a key"
    )
    parser.add_argument(
        "--out",
        type=Path,
        metavar="FOLDER",
        help="keep the replayed flight, with the truth of the recording, for a comparison by report",
    )
    parser.add_argument("--plot", type=Path, metavar="FILE", help="draw the difference (png, pdf, svg)")
    return parser


def _print(result: "Replay", console: Console) -> None:
    steps = len(result.time)
    if result.identical:
        console.print(f"{steps} control steps: every command is equal, bit for bit", highlight=False)
        return
    first = result.first_difference
    if first is None:
        console.print(f"{steps} control steps: all commands are equal, but not all plans", highlight=False)
        return
    when = f"step {first} ({result.time[first]:.2f} s)"
    console.print(f"{steps} control steps: the first command that differs is in {when}", highlight=False)
    table = Table(title="difference of the rotor speeds (rpm)", title_justify="left", box=None)
    table.add_column("vehicle")
    for heading in ("rms", "95 %", "max", "steps that differ"):
        table.add_column(heading, justify="right")
    for index, vehicle in enumerate(result.vehicles):
        difference = rad_s_to_rpm(1.0) * np.abs(result.difference[:, index])
        table.add_row(
            vehicle,
            f"{np.sqrt(np.mean(difference**2)):.1f}",
            f"{np.percentile(difference, 95.0):.1f}",
            f"{difference.max():.1f}",
            f"{np.count_nonzero(difference.any(axis=1))}",
        )
    console.print(table)
