"""config/foxglove_layout.json against a recorded flight: everything that it plots and draws exists."""

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from relform_analysis.flight.from_bag import read_flight_log
from relform_bags.foxglove.command import main
from relform_bags.reader import BagMessage, read_bag
from relform_bags.writer import BagWriter

WORKSPACE = Path(__file__).parents[3]
LAYOUT = json.loads((WORKSPACE / "config/foxglove_layout.json").read_text())
SHORT_FLIGHT = WORKSPACE / "tests/data/short_flight"
STEP = r"\.(\w+)|\[(\d+|:)\]|\{(\w+)==\"(\w+)\"\}"
LIVE = {"/formation/markers", "/leader/reference_path"}
"""Topics of the node ``visualization``, for those who look at a running flight; no bag has them."""
DRAWN = {"geometry_msgs/msg/PoseStamped", "nav_msgs/msg/Path"}
"""The types of ours that 3D panels draw (ThreeDeeRender/ros.ts)."""


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("run") / "drawable"
    assert main([str(SHORT_FLIGHT), "--out", str(folder)]) == 0
    return folder


def plotted() -> Iterator[str]:
    for name, config in LAYOUT["configById"].items():
        if name.startswith(("Plot!", "StateTransitions!")):
            yield from (path["value"] for path in config["paths"])


def value_at(message: Any, path: str, store: Any) -> list[Any]:
    """The values that a message path of Foxglove selects: fields, [index], [:] and {field=="value"}."""
    values = [message]
    steps = re.findall(STEP, path)
    assert re.fullmatch(f"({STEP})+", path), path
    for field, index, key, wanted in steps:
        if field:
            fields = [name for value in values for name, _ in store.get_msgdef(value.__msgtype__).fields]
            assert field in fields or not values, f"{path}: no field {field}"
            values = [getattr(value, field) for value in values]
        elif index == ":":
            values = [part for value in values for part in value]
        elif index:
            values = [value[int(index)] for value in values]
        else:
            values = [value for value in values if getattr(value, key) == wanted]
    return values


def test_every_path_selects_one_value_of_each_message(bag: Path) -> None:
    store = get_typestore(Stores.EMPTY)
    with Reader(bag) as reader:
        for connection in reader.connections:
            store.register(get_types_from_msg(connection.msgdef.data, connection.msgtype))
        topics = {connection.topic: connection for connection in reader.connections}
        paths = list(plotted())
        assert len(paths) > 30
        for path in paths:
            topic, separator, rest = path.partition(".")
            assert topic in topics, path
            messages = list(reader.messages(connections=[topics[topic]]))
            assert len(messages) >= 40
            for _, _, data in messages:
                message = store.deserialize_cdr(data, topics[topic].msgtype)
                (value,) = value_at(message, separator + rest, store)
                assert isinstance(value, int | float | str) or value.ndim == 0


def test_3d_panel_shows_poses_in_the_frame_that_it_follows(bag: Path) -> None:
    panel = LAYOUT["configById"]["3D!team"]
    store = get_typestore(Stores.ROS2_JAZZY)
    with Reader(bag) as reader:
        types = {connection.topic: connection for connection in reader.connections}
        for topic in panel["topics"].keys() - LIVE:
            assert types[topic].msgtype in DRAWN
            for _, _, data in reader.messages(connections=[types[topic]]):
                message: Any = store.deserialize_cdr(data, types[topic].msgtype)
                assert message.header.frame_id == panel["followTf"] == "map"


def test_poses_and_paths_are_the_ground_truth(bag: Path) -> None:
    log = read_flight_log(bag)  # the copy can be read as a flight
    store = get_typestore(Stores.ROS2_JAZZY)
    found: dict[str, list[Any]] = {}
    for entry in read_bag(bag):
        if isinstance(entry, BagMessage) and entry.topic.endswith(("/pose", "/path")):
            found.setdefault(entry.topic, []).append(store.deserialize_cdr(entry.data, entry.type_name))
    for index, vehicle in enumerate(log.scenario.config.team.vehicles):
        poses = found[f"/{vehicle}/pose"]
        (path,) = found[f"/{vehicle}/path"]
        assert len(poses) == len(path.poses) == 41
        for step, pose in enumerate(poses):
            position = pose.pose.position
            assert [position.x, position.y, position.z] == list(log.p_NB_N[step, index])
        assert path.poses == poses


def test_every_panel_is_laid_out_once() -> None:
    def names(node: Any) -> list[str]:
        return [node] if isinstance(node, str) else names(node["first"]) + names(node["second"])

    assert sorted(names(LAYOUT["layout"])) == sorted(LAYOUT["configById"])


@pytest.mark.parametrize(
    ("arguments", "problem"),
    [
        (["nowhere"], "nowhere: no such file or folder"),
        ([str(SHORT_FLIGHT), "--out", str(SHORT_FLIGHT)], "exists already; choose another folder"),
    ],
)
def test_bad_input_is_one_line(
    arguments: list[str], problem: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(arguments) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert problem in line


def test_bag_without_our_topics(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with BagWriter(tmp_path / "bag", {}) as writer:
        writer.add_topic("/clock", "rosgraph_msgs/msg/Clock", [])
        writer.write("/clock", bytes(12), 7, 8)
    assert main([str(tmp_path)]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.endswith("nothing to draw: the bag has no topic <vehicle>/ground_truth")
    assert [path.name for path in tmp_path.iterdir()] == ["bag"]
