#!/usr/bin/env python3
"""Record the topics of a running system into a bag, or complete a bag whose recorder was killed."""

import argparse
import sys
from datetime import datetime
from pathlib import Path

from relform_bags.recover import recover_bag
from relform_bags.split_limits import SplitLimits
from relform_core.errors import RelformError


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, metavar="DIR", help="folder of the new bag (default: bag_<time>)")
    parser.add_argument("--topics", nargs="+", default=[], metavar="TOPIC", help="record only these")
    parser.add_argument("--wall-time", action="store_true", help="log wall time, not that of /clock")
    parser.add_argument(
        "--max-bag-size", type=int, metavar="BYTES", help="go on in the bag's next file at this size"
    )
    parser.add_argument(
        "--max-bag-duration", type=int, metavar="S", help="go on in its next file after so long"
    )
    parser.add_argument("--recover", type=Path, metavar="DIR", help="complete this bag, then exit")
    arguments = parser.parse_args()
    try:
        if arguments.recover is not None:
            return recover(arguments.recover)
        check_limits(arguments.max_bag_size, arguments.max_bag_duration)
    except RelformError as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    out = arguments.out or Path(f"bag_{datetime.now():%Y%m%d-%H%M%S}")
    parameters = {
        "output": repr(str(out)),
        "topics": str(arguments.topics or [""]),
        "use_sim_time": str(not arguments.wall_time).lower(),
        "max_bag_size": str(arguments.max_bag_size or 0),
        "max_bag_duration": str(arguments.max_bag_duration or 0),
    }
    print(f"recording to {out}, Ctrl-C ends it", flush=True)
    return record(parameters)


def check_limits(size: int | None, duration_s: int | None) -> None:
    for name, limit in (("size", size), ("duration", duration_s)):
        if limit == 0:
            raise RelformError(f"--max-bag-{name} must not be 0; leave it away to record a single file")
    SplitLimits(size or 0, duration_s or 0)


def recover(folder: Path) -> int:
    recovered = recover_bag(folder)
    print(f"{folder}: {'completed' if recovered else 'is complete, nothing to do'}")
    return 0


def record(parameters: dict[str, str]) -> int:
    from relform_bags.nodes.recorder import main as run_recorder  # needs ROS, recovering does not

    sys.argv = [sys.argv[0], "--ros-args", "--log-level", "warn"]
    for name, value in parameters.items():
        sys.argv += ["-p", f"{name}:={value}"]
    return run_recorder()


if __name__ == "__main__":
    sys.exit(main())
