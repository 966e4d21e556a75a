"""The command ``fly``: fly a scenario with real nodes, then write summary, report and figure."""

import argparse
import sys
from collections.abc import Sequence
from datetime import datetime
from pathlib import Path

from rich.console import Console

from relform_analysis.flight.metrics import flight_metrics
from relform_analysis.flight.paper_scenario import is_paper
from relform_analysis.flight.summary import Ending, Outcome, build_summary, write_summary
from relform_analysis.report.console import print_table
from relform_bringup.create_folder import create_run_folder
from relform_bringup.flight import Flight, FlownFlight, check_installation
from relform_bringup.interruption import interruption_noted
from relform_bringup.scenario_list import ListScenarios
from relform_controller.reference.fence import check_scenario
from relform_core.errors import RelformError
from relform_core.exit_codes import EXIT_FAILURE, EXIT_FAULT, EXIT_INTERRUPTED
from relform_core.installed import software_versions
from relform_core.load import LoadedScenario, load_scenario
from relform_core.ros_domain import claimed_domain
from relform_core.run_folder import RunFolder
from relform_core.script import CommandParser, command, print_error

EXIT_CODES = {
    Outcome.COMPLETED: 0,
    Outcome.FAILED: EXIT_FAILURE,
    Outcome.FAULT: EXIT_FAULT,
    Outcome.INTERRUPTED: EXIT_INTERRUPTED,
}
EPILOG = """\
Exit codes: 0 flown to the end, 1 a node failed, died or fell silent, 2 the flight cannot start: wrong usage,
scenario, output folder, installation or ROS domain, 3 a vehicle reported a fault, 130 interrupted."""
WIDTH_OF_FILES = 160
IDLE_TIME_S = 7200
"""Length of a flight that waits for requests; the user ends it before."""


@command
def main(arguments: Sequence[str] | None = None) -> int:
    """Fly a scenario; returns the exit code, see --help."""
    options = _parser().parse_args(arguments)
    console = Console(width=None if sys.stdout.isatty() else WIDTH_OF_FILES)
    with interruption_noted() as interruption:
        scenario = _scenario(options)
        check_installation(options.record, options.composed, options.visualize)
        with claimed_domain() as domain_id:
            folder = create_run_folder(scenario, options.out, datetime.now())
            flight = Flight(
                scenario,
                folder,
                options.record,
                options.composed,
                domain_id,
                interruption,
                visualize=options.visualize,
            )
            flown = flight.fly(console)
    match flown.ending:
        case Ending(Outcome.INTERRUPTED, reason):
            print(reason, file=sys.stderr)
        case Ending(_, str(reason)):
            print_error(reason)
    try:
        _conclude(flown, folder, console)
    except RelformError as error:
        print_error(error)
        return EXIT_FAILURE
    return EXIT_CODES[flown.ending.outcome]


def _conclude(flown: FlownFlight, folder: RunFolder, console: Console) -> None:
    log = flown.log
    metrics = flight_metrics(log)
    summary = build_summary(log.scenario, metrics, flown.ending, software_versions())
    write_summary(folder.summary, summary)
    if log.phase:
        print_table(summary, console, with_paper=is_paper(log.scenario.config))
        # Imported here, because both would delay the start of the nodes.
        from relform_analysis.report.flight_page import write_flight_report

        write_flight_report(folder.report, log, summary)
        if flown.ending.outcome is not Outcome.INTERRUPTED:  # the figure takes seconds, the report does not
            from relform_analysis.plots.flight_picture import draw_flight

            draw_flight(log, metrics, folder.figure)
        console.print(f"open {folder.report}", soft_wrap=True, highlight=False)
    console.print(f"{folder.path}: {', '.join(folder.present())}", soft_wrap=True, highlight=False)


def _scenario(options: argparse.Namespace) -> LoadedScenario:
    """What is to be flown; a team that waits for people flies on the wall clock."""
    pacing = ["pacing=real_time"] if options.real_time or options.idle else []
    overrides = [*pacing, *options.overrides]
    scenario = load_scenario(options.scenario, overrides, options.seed)
    if not options.idle:
        check_scenario(scenario.config)
        return scenario
    if scenario.config.ground is None:
        overrides += [f"ground={{waits: true, time_s: {IDLE_TIME_S}}}"]
    else:
        overrides += ["ground.waits=true", f"ground.time_s={IDLE_TIME_S}"]
    return load_scenario(options.scenario, overrides, options.seed)


def _parser() -> CommandParser:
    parser = CommandParser(
        prog="fly",
        description="Fly a scenario with ROS nodes, recorded and scored.",
        epilog=EPILOG,
    )
    parser.add_argument(
        "--scenario", required=True, metavar="FILE", help="path or plain name of the scenario, such as paper"
    )
    parser.add_argument(
        "--list", action=ListScenarios, help="print names and titles of the installed scenarios and exit"
    )
    parser.add_argument(
        "--seed", type=int, help="seed of all random draws (default: the seed in the scenario, or 0)"
    )
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help="run folder, must not exist (default: a new one in runs/)"
    )
    parser.add_overrides("change a key of the scenario, as in controller.horizon_steps=10; may be repeated")
    parser.add_argument(
        "--idle",
        action="store_true",
        help="fly on the wall clock, from the ground, by requests: take_off, go_to, land ...; Ctrl-C ends it",
    )
    parser.add_argument("--no-record", action="store_false", dest="record", help="fly without a recorder")
    parser.add_argument(
        "--real-time",
        action="store_true",
        help="fly on the wall clock, as --set pacing=real_time (default: in lock-step, as fast as it can)",
    )
    parser.add_argument(
        "--composed",
        action="store_true",
        help="run all nodes in one process, with a quarter of the CPU time (default: a process per node)",
    )
    parser.add_argument(
        "--visualize",
        action="store_true",
        help="publish /tf, markers, paths and vehicle models for RViz and the like (default: no such topics)",
    )
    return parser
