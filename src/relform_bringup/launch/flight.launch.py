"""Start all nodes of a flight.

    ros2 launch relform_bringup flight.launch.py scenario:=paper output:=runs/launched

It is the flight of `fly`, without live line, table and report. It ends with the flight.
"""

from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction, RegisterEventHandler, Shutdown
from launch.event_handlers import OnProcessExit
from launch.events.process import ProcessExited
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

from relform_core.load import load_scenario

RECORDER = "/recorder"


def generate_launch_description() -> LaunchDescription:
    """The arguments, and what they start."""
    return LaunchDescription(
        [
            DeclareLaunchArgument("scenario", default_value="paper", description="path or plain name"),
            DeclareLaunchArgument("output", default_value="", description="folder of the bag; empty: none"),
            DeclareLaunchArgument(
                "visualize", default_value="true", description="publish /tf, models, markers and paths"
            ),
            OpaqueFunction(function=start_nodes),
        ]
    )


def start_nodes(context: LaunchContext) -> list[Node | RegisterEventHandler]:
    """The nodes, and the end of all when the flight is over or a node is lost."""
    scenario = LaunchConfiguration("scenario").perform(context)
    output = LaunchConfiguration("output").perform(context)
    member = {"scenario": scenario, "observers": [RECORDER] if output else [""]}
    members = [
        *(
            Node(package="relform_sim", executable="quadrotor", namespace=vehicle, parameters=[member])
            for vehicle in load_scenario(scenario).config.team.vehicles
        ),
        Node(package="relform_controller", executable="controller", parameters=[member]),
        Node(package="relform_sim", executable="clock", parameters=[member]),
    ]
    if output:
        members.append(
            Node(package="relform_bags", executable="recorder", parameters=[member, {"output": output}])
        )
    flying = set(members)

    def on_exit(event: ProcessExited, context: LaunchContext) -> list[Shutdown]:
        """Members end by themselves, the recorder when its bag is closed."""
        if event.action not in flying:
            return []
        flying.discard(event.action)
        if event.returncode != 0:
            return [Shutdown(reason=f"{event.process_name} exited with code {event.returncode}")]
        return [] if flying else [Shutdown(reason="the flight is over")]

    beside = []
    if LaunchConfiguration("visualize").perform(context) == "true":
        beside.append(
            Node(package="relform_bringup", executable="visualization", parameters=[{"scenario": scenario}])
        )
    return [RegisterEventHandler(OnProcessExit(on_exit=on_exit)), *members, *beside]
