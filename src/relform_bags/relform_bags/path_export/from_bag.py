"""Poses over time from the messages of a bag."""

import math
from pathlib import Path
from typing import Any

import numpy as np

from relform_bags.from_bag import decode
from relform_bags.reader import BagMessage, read_bag
from relform_core.arrays import Array
from relform_core.errors import BagError
from relform_core.units import NANOSECONDS_PER_SECOND

POSE_TYPES = (
    "nav_msgs/msg/Odometry",
    "geometry_msgs/msg/PoseStamped",
    "geometry_msgs/msg/PoseWithCovarianceStamped",
)
PATH_TYPE = "nav_msgs/msg/Path"


def recorded_poses(bag: Path, topic: str) -> Array:
    """Time [s], x, y, z [m] and yaw [rad] of each pose, shape (pose, 5), by the stamps of the messages.

    A pose that is not after the one before is left out.

    Args:
        bag: file or folder of the bag, or folder of the run.
        topic: of poses, or of paths, the last of which counts.
    Raises:
        BagError: one line: the bag cannot be read, or the topic is missing, of another type, or empty.
    """
    messages = [entry for entry in read_bag(bag) if isinstance(entry, BagMessage)]
    found = [message for message in messages if message.topic == topic]
    if not found or found[0].type_name not in (*POSE_TYPES, PATH_TYPE):
        usable = {each.topic for each in messages if each.type_name in (*POSE_TYPES, PATH_TYPE)}
        known = f"topics with poses are {', '.join(sorted(usable))}" if usable else "no topic has poses"
        raise BagError(f"{bag}: no poses on topic '{topic}'; {known}")
    if found[0].type_name == PATH_TYPE:
        rows = [_row(each.header, each.pose) for each in decode(found[-1]).poses]
    else:
        decoded = [decode(message) for message in found]
        # Messages with a covariance have the pose one level deeper.
        rows = [_row(each.header, getattr(each.pose, "pose", each.pose)) for each in decoded]
    poses: list[list[float]] = []
    first_ns = rows[0][0] if rows else 0
    for stamp_ns, row in rows:
        if not all(map(math.isfinite, row)):
            raise BagError(f"{bag}: {topic} has a pose that is not finite")
        time = (stamp_ns - first_ns) / NANOSECONDS_PER_SECOND
        if not poses or time > poses[-1][0]:
            poses.append([time, *row])
    if len(poses) < 2:
        raise BagError(f"{bag}: {topic} has {len(poses)} poses with different stamps, at least 2 are needed")
    return np.array(poses)


def _row(header: Any, pose: Any) -> tuple[int, list[float]]:
    """Stamp [ns]; x, y, z [m] and yaw [rad]."""
    p, q = pose.position, pose.orientation
    yaw = math.atan2(2.0 * (q.w * q.z + q.x * q.y), 1.0 - 2.0 * (q.y**2 + q.z**2))
    stamp_ns = header.stamp.sec * NANOSECONDS_PER_SECOND + header.stamp.nanosec
    return stamp_ns, [p.x, p.y, p.z, yaw]
