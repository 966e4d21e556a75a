"""Positions of the vehicles from the bag of a flight, as PoseStamped and Path, which 3D views draw."""

from collections.abc import Iterable, Iterator
from contextlib import suppress

from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Odometry
from nav_msgs.msg import Path as PathMsg
from rclpy.serialization import serialize_message

from relform_bags.reader import BagMessage
from relform_core.names import GROUND_TRUTH
from relform_ros.raw import decoded
from relform_ros.rejection import RejectionError

TRUTH, TRUTH_TYPE = f"/{GROUND_TRUTH}", "nav_msgs/msg/Odometry"
POSE, POSE_TYPE = "/pose", "geometry_msgs/msg/PoseStamped"
PATH, PATH_TYPE = "/path", "nav_msgs/msg/Path"


def drawable_poses(messages: Iterable[BagMessage]) -> Iterator[BagMessage]:
    """For each vehicle with ground truth its whole path, at its first log time, then its poses.

    Args:
        messages: of the bag, in the order of recording.
    """
    truths: dict[str, list[BagMessage]] = {}
    for message in messages:
        if message.topic.endswith(TRUTH) and message.type_name == TRUTH_TYPE:
            truths.setdefault(message.topic.removesuffix(TRUTH), []).append(message)
    for vehicle, entries in truths.items():
        poses, times = [], []
        for entry in entries:
            with suppress(RejectionError):
                poses.append(_pose(entry.data))
                times.append((entry.log_time_ns, entry.publish_time_ns))
        if not poses:
            continue
        flown = serialize_message(PathMsg(header=poses[0].header, poses=poses))
        yield BagMessage(vehicle + PATH, PATH_TYPE, flown, *times[0])
        for pose, (log_ns, publish_ns) in zip(poses, times, strict=True):
            yield BagMessage(vehicle + POSE, POSE_TYPE, serialize_message(pose), log_ns, publish_ns)


def _pose(data: bytes) -> PoseStamped:
    odometry = decoded(data, Odometry)
    return PoseStamped(header=odometry.header, pose=odometry.pose.pose)
