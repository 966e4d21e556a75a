"""The command ``live``: a flight in a browser, while it is flown or from its bag."""

import argparse
from collections.abc import Sequence

from relform_core.script import CommandParser, command

PORT = 8080
PORTS = range(1024, 65536)
"""Those below are of the system."""


@command
def main(arguments: Sequence[str] | None = None) -> int:
    """Show flights; returns the exit code."""
    options = _parser().parse_args(arguments)
    # Imported here, because the help needs neither ROS nor a web server.
    from relform_live.nodes.live import run_live
    from relform_live.viewer.server import serving, url

    with serving(options.port) as server:
        print(f"open {url(server)} in a browser, Ctrl-C ends the view", flush=True)
        return run_live(server, options.config)


def _parser() -> CommandParser:
    parser = CommandParser(
        prog="live",
        description="Show the flight that runs in this ROS domain in a browser, or the next one that starts.",
    )
    parser.add_argument("--port", type=_port, default=PORT, help=f"of the page on this machine ({PORT})")
    parser.add_argument(
        "--config",
        metavar="FILE",
        help="path or plain name of the scenario that is flown (default: its controller names it)",
    )
    return parser


def _port(text: str) -> int:
    port = int(text)
    if port not in PORTS:
        raise argparse.ArgumentTypeError(f"must be from {PORTS[0]} to {PORTS[-1]}, not {port}")
    return port
