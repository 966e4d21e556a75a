"""Look at a flight, or at a bag that is played, in RViz.

ros2 launch relform_bringup rviz.launch.py scenario:=paper
"""

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node


def generate_launch_description() -> LaunchDescription:
    """RViz, and what draws for it."""
    layout = str(Path(get_package_share_directory("relform_bringup"), "rviz", "relform.rviz"))
    return LaunchDescription(
        [
            DeclareLaunchArgument("scenario", default_value="paper", description="that of the flight"),
            DeclareLaunchArgument(
                "visualize", default_value="true", description="false: the flight has the node already"
            ),
            Node(
                package="relform_bringup",
                executable="visualization",
                parameters=[{"scenario": LaunchConfiguration("scenario")}],
                condition=IfCondition(LaunchConfiguration("visualize")),
            ),
            Node(
                package="rviz2",
                executable="rviz2",
                arguments=["-d", layout],
                parameters=[{"use_sim_time": True}],
            ),
        ]
    )
