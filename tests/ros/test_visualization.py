"""What the node ``visualization`` publishes of a flight of real nodes, as tools of ROS read it."""

import json
import math
import signal
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import domain_coordinator
import numpy as np
import pytest
import yaml
from nav_msgs.msg import Path as PathMsg
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import Marker, MarkerArray

from relform_analysis.flight.simulate import fly_in_process
from relform_ros.fields import stamp_from_msg
from relform_ros.qos import LATCHED
from support.frames import by_stamp, parents
from support.nodes import Nodes
from support.observer import Observer
from support.scenarios import NOISE_FREE, paper_scenario

WORKSPACE = Path(__file__).parents[2]
LAYOUT = WORKSPACE / "src/relform_bringup/rviz/relform.rviz"
FOXGLOVE = WORKSPACE / "config/foxglove_layout.json"
ONLY_IN_COPIES = "/pose"
"""End of topics that only bags have that were copied for Foxglove."""
NOT_CHOSEN = {"/tf", "/tf_static", "/parameter_events"}
"""Topics that a user of RViz does not choose."""
TEAM = ("leader", "follower_1", "follower_2")
SCENARIO = paper_scenario(
    *NOISE_FREE,
    "start.yaw_deg=50",
    "start.position_m=[3.0, -2.0, 4.0]",
    "phases=[{name: B, title: straight, duration_s: 3.0, steady_from_s: 1.0, formation: initial, "
    "motion: {kind: straight, speed_m_s: 2.0, ramp_s: 1.5}}]",
    "obstacles=[{kind: sphere, center_m: [30, 2, 3], radius_m: 0.5}]",
    seed=3,
)


@dataclass(frozen=True)
class Seen:
    """Messages of one flight."""

    tf: list[Any]
    static: list[Any]
    descriptions: dict[str, list[Any]]
    markers: list[Any]
    paths: dict[str, list[Any]]
    reference_path: list[Any]
    published: dict[str, str]
    """Type by topic."""


@pytest.fixture(scope="module")
def seen(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Seen]:
    with (
        domain_coordinator.domain_id() as domain,
        Observer.running(domain) as observer,
        Nodes(SCENARIO, tmp_path_factory.mktemp("run"), domain) as nodes,
    ):
        collect = observer.collect
        seen = Seen(
            collect(TFMessage, "/tf"),
            collect(TFMessage, "/tf_static", LATCHED),
            {name: collect(String, f"/{name}/robot_description", LATCHED) for name in TEAM},
            collect(MarkerArray, "/formation/markers"),
            {name: collect(PathMsg, f"/{name}/path") for name in TEAM},
            collect(PathMsg, "/leader/reference_path"),
            {},
        )
        nodes.start("visualization")
        observer.until(lambda: all(seen.descriptions.values()))
        for name in (*TEAM, "controller", "clock"):
            nodes.start(name)
        flying = [nodes.processes[name] for name in (*TEAM, "controller", "clock")]
        observer.until(lambda: all(process.poll() is not None for process in flying))
        assert [process.returncode for process in flying] == [0] * 5
        of_node = observer.node.get_publisher_names_and_types_by_node("visualization", "/")
        seen.published.update({topic: type_name for topic, (type_name,) in of_node})
        nodes.processes["visualization"].send_signal(signal.SIGINT)
        assert nodes.end("visualization")[0] == 0
        yield seen


def test_frames_are_one_tree(seen: Seen) -> None:
    rotors = {
        f"{name}/rotor_{rotor}": f"{name}/base_link"
        for name in TEAM
        for rotor in ("front", "left", "back", "right")
    }
    in_the_world = {f"{prefix}{name}/base_link": "map" for name in TEAM for prefix in ("", "truth/")}
    assert parents([*seen.tf, *seen.static]) == rotors | in_the_world


TILT_OF_ANOTHER_STEP = 0.2
"""Where the reading of an IMU was lost, the one before is used [rad]."""


@pytest.mark.parametrize("vehicle", TEAM)
def test_frames_of_a_flight_with_perfect_sensors_are_the_true_ones(seen: Seen, vehicle: str) -> None:
    """Stamps are simulation time, so a flight without ROS says where the vehicle was."""
    log = fly_in_process(SCENARIO)
    index = SCENARIO.config.team.vehicles.index(vehicle)
    for prefix, tolerance, tilt in (("truth/", 0.0, 1e-6), ("", 1e-6, TILT_OF_ANOTHER_STEP)):
        frames = by_stamp(seen.tf, f"{prefix}{vehicle}/base_link")
        assert len(frames) > 3
        for stamp_ns, (position, quaternion) in frames.items():
            step = stamp_ns // SCENARIO.config.period_ns
            assert stamp_ns == step * SCENARIO.config.period_ns
            assert position == pytest.approx(log.p_NB_N[step, index], abs=tolerance)
            assert 2.0 * math.acos(min(1.0, abs(quaternion @ log.q_NB[step, index]))) <= tilt


def test_frames_come_at_most_twenty_times_a_second(seen: Seen) -> None:
    stamps = sorted(by_stamp(seen.tf, "follower_1/base_link"))
    assert all(later - earlier >= 50_000_000 for earlier, later in pairwise(stamps))


def test_models_have_the_frames_of_the_tree(seen: Seen) -> None:
    frames = parents([*seen.tf, *seen.static]).keys()
    for name, (message,) in seen.descriptions.items():
        robot = ElementTree.fromstring(message.data)
        assert robot.attrib["name"] == name
        assert {link.attrib["name"] for link in robot.findall("link")} <= frames


def test_markers_show_the_team_its_targets_and_the_obstacle(seen: Seen) -> None:
    groups = {(marker.ns, marker.id): marker for marker in seen.markers[-1].markers}
    one_each = ("vehicles", "collision", "names", "targets")
    expected = {(group, number) for group in one_each for number in range(3)}
    assert groups.keys() == expected | {("links", 0), ("obstacles", 0)}
    assert {marker.header.frame_id for marker in groups.values()} == {"map"}
    assert {marker.action for marker in groups.values()} == {Marker.ADD}
    assert [groups["names", number].text for number in range(3)] == list(TEAM)
    assert len(groups["links", 0].points) == 2 * 3
    assert groups["obstacles", 0].pose.position.x == 30.0


def test_paths_are_where_the_vehicles_flew_and_the_leader_should(seen: Seen) -> None:
    log = fly_in_process(SCENARIO)
    period_ns = SCENARIO.config.period_ns
    for index, name in enumerate(TEAM):
        path = seen.paths[name][-1]
        assert path.poses
        for pose in path.poses:
            step = stamp_from_msg(pose.header.stamp) // period_ns
            position = [getattr(pose.pose.position, axis) for axis in "xyz"]
            assert position == pytest.approx(log.p_NB_N[step, index], abs=1e-6)
    first = seen.reference_path[0]
    steps = np.array([stamp_from_msg(pose.header.stamp) // period_ns for pose in first.poses])
    assert (np.diff(steps) > 0).all()
    assert steps[-1] >= SCENARIO.config.n_steps - 2
    for pose, step in zip(first.poses, steps, strict=True):
        position = [getattr(pose.pose.position, axis) for axis in "xyz"]
        assert position == pytest.approx(log.p_NB_N[min(step, len(log.p_NB_N) - 1), 0], abs=0.1)


def test_the_layout_of_rviz_names_what_is_published(seen: Seen) -> None:
    types = {
        "MarkerArray": "visualization_msgs/msg/MarkerArray",
        "Path": "nav_msgs/msg/Path",
        "RobotModel": "std_msgs/msg/String",
    }
    manager = yaml.safe_load(LAYOUT.read_text())["Visualization Manager"]
    shown = {
        topic["Value"]: types[display["Class"].removeprefix("rviz_default_plugins/")]
        for display in manager["Displays"]
        if (topic := display.get("Topic") or display.get("Description Topic"))
    }
    assert manager["Global Options"]["Fixed Frame"] == "map"
    assert shown == {topic: name for topic, name in seen.published.items() if topic not in NOT_CHOSEN}
    latched = {
        d["Description Topic"]["Durability Policy"] for d in manager["Displays"] if "Description Topic" in d
    }
    assert latched == {"Transient Local"}


def test_the_layout_of_foxglove_draws_a_running_flight(seen: Seen) -> None:
    drawn = {"nav_msgs/msg/Path", "visualization_msgs/msg/MarkerArray"}
    chosen = json.loads(FOXGLOVE.read_text())["configById"]["3D!team"]["topics"]
    live = {topic for topic in chosen if not topic.endswith(ONLY_IN_COPIES)}
    assert live == {topic for topic, name in seen.published.items() if name in drawn}
