#!/usr/bin/env python3
"""Record the topics of a running system into a bag, or complete a bag whose recorder was killed."""

import argparse
import sys
from datetime import datetime
from pathlib import Path

from relform_core.errors import RelformError
from relform_tools.bag_recover import recover_bag


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, metavar="DIR", help="folder of the new bag (default: bag_<time>)")
    parser.add_argument("--topics", nargs="+", default=[], metavar="TOPIC", help="record only these")
    parser.add_argument("--wall-time", action="store_true", help="log wall time, not that of /clock")
    parser.add_argument("--recover", type=Path, metavar="DIR", help="complete this bag, then exit")
    arguments = parser.parse_args()
    if arguments.recover is not None:
        return recover(arguments.recover)
    out = arguments.out or Path(f"bag_{datetime.now():%Y%m%d-%H%M%S}")
    parameters = {
        "output": repr(str(out)),
        "topics": str(arguments.topics or [""]),
        "use_sim_time": str(not arguments.wall_time).lower(),
    }
    print(f"recording to {out}, Ctrl-C ends it", flush=True)
    return record(parameters)


def recover(folder: Path) -> int:
    try:
        recovered = recover_bag(folder)
    except RelformError as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    print(f"{folder}: {'completed' if recovered else 'is complete, nothing to do'}")
    return 0


def record(parameters: dict[str, str]) -> int:
    from relform_tools.recorder_node import main as run_recorder  # needs ROS, recovering does not

    sys.argv = [sys.argv[0], "--ros-args"]
    for name, value in parameters.items():
        sys.argv += ["-p", f"{name}:={value}"]
    return run_recorder()


if __name__ == "__main__":
    sys.exit(main())
