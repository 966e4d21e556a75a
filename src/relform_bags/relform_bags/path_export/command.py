"""The command line that writes the path of a vehicle in a bag as a CSV file, for the motion ``path``."""

import argparse
import math
from collections.abc import Sequence
from pathlib import Path

from relform_bags.path_export.smooth import smoothed
from relform_core.errors import BagError
from relform_core.names import GROUND_TRUTH, vehicle_topic
from relform_core.path_file import write_path
from relform_core.script import CommandParser, command


@command
def main(arguments: Sequence[str] | None = None) -> int:
    """Write the file; returns the exit code."""
    parser = CommandParser(
        prog="export_path",
        description="Write the path of a vehicle in a bag as a CSV file, which a scenario flies with the "
        "motion 'path'. The topic may have the type Odometry, PoseStamped, PoseWithCovarianceStamped or Path "
        "(its last message).",
    )
    parser.add_argument("bag", type=Path, metavar="BAG", help="bag, or folder of a run")
    default = vehicle_topic("leader", GROUND_TRUTH)
    parser.add_argument("--topic", default=default, help=f"topic of the poses (default {default})")
    parser.add_argument(
        "--period", type=_positive_s, default=0.2, metavar="S", help="time between samples (default 0.2)"
    )
    parser.add_argument(
        "--start", type=float, default=0.0, metavar="S", help="from here on, from the first pose (default 0)"
    )
    parser.add_argument("--end", type=float, metavar="S", help="until here (default: the last pose)")
    parser.add_argument(
        "--out", type=Path, default=Path("path.csv"), metavar="FILE", help="file to write (default path.csv)"
    )
    options = parser.parse_args(arguments)
    from relform_bags.path_export.from_bag import recorded_poses  # needs ROS, the help does not

    poses = recorded_poses(options.bag, options.topic)
    elapsed = poses[:, 0] - poses[0, 0]
    end = math.inf if options.end is None else options.end
    chosen = poses[(elapsed >= options.start) & (elapsed <= end)]
    if len(chosen) < 2 or chosen[-1, 0] - chosen[0, 0] < options.period:
        raise BagError(
            f"{options.bag}: {options.topic} has {len(chosen)} poses from {options.start:g} s to {end:g} s, "
            f"less than one --period of {options.period:g} s; its poses end at {elapsed[-1]:.2f} s"
        )
    samples = smoothed(chosen, options.period)
    write_path(options.out, samples)
    print(f"{options.out}: {len(samples)} samples, {samples[-1, 0]:.2f} s")
    return 0


def _positive_s(text: str) -> float:
    value = float(text)
    if not 0.0 < value < math.inf:
        raise argparse.ArgumentTypeError(f"must be above 0 s, not {value:g}")
    return value
