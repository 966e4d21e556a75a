"""The message of /tf, which set-up builds where no package index has tf2_msgs, is that of ROS."""

from relform_bags.message_types import message_type

TYPE = "tf2_msgs/msg/TFMessage"
HASH_IN_ROS = "RIHS01_e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087"
"""As `ros2 topic info --verbose /tf` prints it on an installed Jazzy."""


def test_other_machines_take_it_for_the_same_type() -> None:
    assert message_type(TYPE).type_hash == HASH_IN_ROS
    assert message_type(TYPE).definition.startswith("geometry_msgs/TransformStamped[] transforms\n")
