#!/usr/bin/env python3
"""Play a bag, listen to all of it, and say whether every message came, in order and on time."""

import argparse
import os
import sys
from pathlib import Path

import numpy as np
import numpy.typing as npt

from relform_core.errors import RelformError


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("bag", type=Path, metavar="BAG", help="bag, or folder of a run")
    parser.add_argument("--rates", type=float, nargs="+", default=[1.0, 5.0, 0.2], metavar="RATE")
    arguments = parser.parse_args()
    from relform_bags.nodes.playback_check import check_playback  # needs ROS, the help does not
    from relform_core.ros_domain import claimed_domain

    print("rate   messages   heard   in order   late by: median    95 %     max")
    complete = True
    try:
        with claimed_domain(beside_shells=False) as domain_id:
            os.environ["ROS_DOMAIN_ID"] = str(domain_id)
            for rate in arguments.rates:
                check = check_playback(arguments.bag, rate)
                complete &= check.is_complete
                counts = f"{rate:4g} {len(check.expected):10} {len(check.heard):7}"
                verdict = f"       yes {timing(check.delay)}" if check.is_complete else "        NO"
                print(counts, verdict, flush=True)
    except RelformError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    return 0 if complete else 1


def timing(delay: npt.NDArray[np.float64]) -> str:
    milliseconds = 1e3 * np.percentile(delay, [50.0, 95.0, 100.0])
    return "{:18.2f} {:7.2f} {:7.2f} ms".format(*milliseconds)


if __name__ == "__main__":
    sys.exit(main())
