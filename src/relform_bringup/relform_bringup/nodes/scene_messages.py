"""What is drawn as messages: transforms, markers, paths. Frames and stamps as everywhere in a flight."""

from collections.abc import Iterable

from geometry_msgs.msg import Pose as PoseMsg
from geometry_msgs.msg import PoseStamped, Transform, TransformStamped
from nav_msgs.msg import Path as PathMsg
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker

from relform_bringup.scene.poses import Pose
from relform_bringup.scene.shapes import Shape
from relform_bringup.scene.urdf import red_green_blue
from relform_ros.fields import (
    WORLD_FRAME,
    header_to_msg,
    point_to_msg,
    quaternion_to_msg,
    vector_to_msg,
)


def transform_to_msg(stamp_ns: int, pose: Pose, child: str, parent: str = WORLD_FRAME) -> TransformStamped:
    """The pose of the frame ``child`` in the frame ``parent``."""
    transform = Transform(translation=vector_to_msg(pose.p_NB_N), rotation=quaternion_to_msg(pose.q_NB))
    return TransformStamped(header=header_to_msg(stamp_ns, parent), child_frame_id=child, transform=transform)


def path_to_msg(stamp_ns: int, poses: Iterable[tuple[int, Pose]]) -> PathMsg:
    """A path in the world: instants [ns] and poses, oldest first."""
    stamped = [
        PoseStamped(header=header_to_msg(at_ns, WORLD_FRAME), pose=_pose_to_msg(pose))
        for at_ns, pose in poses
    ]
    return PathMsg(header=header_to_msg(stamp_ns, WORLD_FRAME), poses=stamped)


def marker_to_msg(stamp_ns: int, shape: Shape) -> Marker:
    """A shape in the world."""
    marker = Marker(
        header=header_to_msg(stamp_ns, WORLD_FRAME),
        ns=shape.group,
        id=shape.number,
        type=int(shape.kind),
        action=Marker.ADD,
        pose=_pose_to_msg(shape.pose),
        color=_colour_to_msg(shape.colour, shape.opacity),
        points=[point_to_msg(point) for point in shape.points],
        text=shape.text,
    )
    marker.scale.x, marker.scale.y, marker.scale.z = shape.size
    return marker


def _pose_to_msg(pose: Pose) -> PoseMsg:
    return PoseMsg(position=point_to_msg(pose.p_NB_N), orientation=quaternion_to_msg(pose.q_NB))


def _colour_to_msg(colour: str, opacity: float) -> ColorRGBA:
    red, green, blue = red_green_blue(colour)
    return ColorRGBA(r=red, g=green, b=blue, a=opacity)
