"""The launch files, run by the launch system of ROS; skipped with the wheels, which have none."""

from pathlib import Path
from typing import Any

import pytest

from support.nodes import short
from support.scenarios import paper_scenario

pytest.importorskip("launch.actions", reason="no launch system of ROS")
pytest.importorskip("launch_ros.actions", reason="no launch system of ROS")

LAUNCH = Path(__file__).parents[2] / "src/relform_bringup/launch"


def service(name: str, **arguments: str) -> Any:
    from launch import LaunchService
    from launch.actions import IncludeLaunchDescription
    from launch.launch_description_sources import PythonLaunchDescriptionSource

    service = LaunchService(noninteractive=True)
    source = PythonLaunchDescriptionSource(str(LAUNCH / name))
    service.include_launch_description(
        IncludeLaunchDescription(source, launch_arguments=list(arguments.items()))
    )
    return service


def test_a_launched_flight_ends_by_itself_and_is_recorded(tmp_path: Path) -> None:
    scenario, bag = tmp_path / "config.yaml", tmp_path / "bag"
    scenario.write_text(paper_scenario(short(1.0)).effective_yaml)
    assert service("flight.launch.py", scenario=str(scenario), output=str(bag)).run() == 0
    assert (bag / "metadata.yaml").exists()


def test_a_node_that_is_lost_ends_the_launch(tmp_path: Path) -> None:
    """The recorder cannot write into an existing folder."""
    scenario = tmp_path / "config.yaml"
    scenario.write_text(paper_scenario(short(1.0)).effective_yaml)
    assert service("flight.launch.py", scenario=str(scenario), output=str(tmp_path)).run() == 0


def test_rviz_is_described_with_what_draws_for_it() -> None:
    import importlib.util

    spec = importlib.util.spec_from_file_location("rviz_launch", LAUNCH / "rviz.launch.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    nodes = [
        each for each in module.generate_launch_description().entities if hasattr(each, "node_executable")
    ]
    assert [(node.node_package, node.node_executable) for node in nodes] == [
        ("relform_bringup", "visualization"),
        ("rviz2", "rviz2"),
    ]
