"""The command line that plays a bag, listens to it, and checks that every message came in time."""

import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt

from relform_core.exit_codes import EXIT_FAILURE
from relform_core.script import CommandParser, command


@command
def main(arguments: Sequence[str] | None = None) -> int:
    """Check a bag at each rate; returns the exit code, 1 if a message was missing or out of order."""
    parser = CommandParser(
        prog="check_playback",
        description="Play a bag, listen to it, and check that every message came, in order and in time.",
    )
    parser.add_argument("bag", type=Path, metavar="BAG", help="bag, or folder of a run")
    parser.add_argument("--rates", type=float, nargs="+", default=[1.0, 5.0, 0.2], metavar="RATE")
    options = parser.parse_args(arguments)
    from relform_bags.nodes.playback_check import check_playback  # needs ROS, the help does not
    from relform_core.ros_domain import claimed_domain

    print("rate   messages   heard   in order   late by: median    95 %     max")
    complete = True
    with claimed_domain(beside_shells=False) as domain_id:
        os.environ["ROS_DOMAIN_ID"] = str(domain_id)
        for rate in options.rates:
            check = check_playback(options.bag, rate)
            complete &= check.is_complete
            counts = f"{rate:4g} {len(check.expected):10} {len(check.heard):7}"
            verdict = f"       yes {_percentiles(check.delay)}" if check.is_complete else "        NO"
            print(counts, verdict, flush=True)
    return 0 if complete else EXIT_FAILURE


def _percentiles(delay: npt.NDArray[np.float64]) -> str:
    milliseconds = 1e3 * np.percentile(delay, [50.0, 95.0, 100.0])
    return "{:18.2f} {:7.2f} {:7.2f} ms".format(*milliseconds)
