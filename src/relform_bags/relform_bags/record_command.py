"""The command line that records a running system, or completes a bag after its recorder was killed."""

import argparse
from collections.abc import Sequence
from dataclasses import replace
from datetime import datetime
from pathlib import Path

from relform_bags.options import TopicRecorderOptions
from relform_bags.recover import recover_bag
from relform_core.errors import BagError
from relform_core.script import CommandParser, command


@command
def main(arguments: Sequence[str] | None = None) -> int:
    """Record until a signal arrives, or recover a bag; returns the exit code."""
    parsed = _parser().parse_args(arguments)
    if parsed.recover is not None:
        return _recover(parsed.recover)
    options = _options(parsed)
    from relform_bags.nodes.recorder import main as run_recorder  # needs ROS, recovering does not

    print(f"recording to {options.output}, Ctrl-C ends it", flush=True)
    clock = ["-p", f"use_sim_time:={str(not parsed.wall_time).lower()}"]
    return run_recorder(["--ros-args", "--log-level", "warn", *clock, *options.parameter_arguments()])


def _parser() -> CommandParser:
    parser = CommandParser(
        prog="record",
        description="Record the topics of a running system into a bag, or complete a bag after its recorder "
        "was killed.",
    )
    parser.add_argument(
        "--out", dest="output", metavar="DIR", help="folder of the new bag (default: bag_<time>)"
    )
    parser.add_argument("--topics", nargs="+", default=(), metavar="TOPIC", help="record only these")
    parser.add_argument("--wall-time", action="store_true", help="log wall time, not the time of /clock")
    parser.add_argument(
        "--max-bag-size", type=int, metavar="BYTES", help="continue in the next file of the bag at this size"
    )
    parser.add_argument(
        "--max-bag-duration", type=int, metavar="S", help="continue in the next file after this time"
    )
    parser.add_argument("--recover", type=Path, metavar="DIR", help="complete this bag, then exit")
    return parser


def _options(parsed: argparse.Namespace) -> TopicRecorderOptions:
    for name in ("max_bag_size", "max_bag_duration"):
        if getattr(parsed, name) is None:
            delattr(parsed, name)
        elif getattr(parsed, name) == 0:
            flag = name.replace("_", "-")
            raise BagError(f"--{flag} must not be 0; omit it to record a single file")
    options = TopicRecorderOptions.from_arguments(parsed)
    return replace(options, output=options.output or f"bag_{datetime.now():%Y%m%d-%H%M%S}")


def _recover(folder: Path) -> int:
    recovered = recover_bag(folder)
    print(f"{folder}: {'completed' if recovered else 'is complete, nothing to do'}")
    return 0
