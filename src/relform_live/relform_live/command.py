"""The command ``live``: a flight in a browser, while it is flown or from its bag."""

import argparse
from collections.abc import Sequence
from pathlib import Path

from relform_core.exit_codes import EXIT_USAGE
from relform_core.script import CommandParser, command

PORT = 8080
PORTS = range(1024, 65536)
"""Those below are of the system."""


@command
def main(arguments: Sequence[str] | None = None) -> int:
    """Show flights; returns the exit code."""
    parser = _parser()
    options = parser.parse_args(arguments)
    if options.bag is not None and options.fly is not None:
        parser.error("a bag and --fly exclude each other")
    # Imported here, because the help needs neither ROS nor a web server.
    from relform_live.viewer.server import serving, url

    with serving(options.port) as server:
        address = f"open {url(server)} in a browser, Ctrl-C ends the view"
        if options.bag is not None:
            from relform_live.from_bag import read_recording
            from relform_live.show_recording import show_recording

            recording = read_recording(options.bag, options.config)
            print(address, flush=True)
            show_recording(server, recording)
            return 0
        from relform_live.nodes.live import run_live

        print(address, flush=True)
        if options.fly is None:
            return run_live(server, options.config)
        from relform_live.flying import flying

        with flying(options.fly) as flight:
            run_live(server, options.config, has_failed=lambda: flight.poll() == EXIT_USAGE)
        return flight.returncode


def _parser() -> CommandParser:
    parser = CommandParser(
        prog="live",
        description="Show in a browser the flight that runs in this ROS domain or the next one that starts, "
        "a recorded flight, or one that this command starts.",
    )
    parser.add_argument("bag", nargs="?", type=Path, metavar="BAG", help="bag, or folder of a run, to show")
    parser.add_argument("--port", type=_port, default=PORT, help=f"of the page on this machine ({PORT})")
    parser.add_argument(
        "--config",
        metavar="FILE",
        help="path or plain name of the scenario that is flown (default: the controller or the bag names it)",
    )
    parser.add_argument(
        "--fly",
        nargs=argparse.REMAINDER,
        metavar="OPTION",
        help="start a flight too; what follows are the options of fly, as in --fly --scenario paper",
    )
    return parser


def _port(text: str) -> int:
    port = int(text)
    if port not in PORTS:
        raise argparse.ArgumentTypeError(f"must be from {PORTS[0]} to {PORTS[-1]}, not {port}")
    return port
