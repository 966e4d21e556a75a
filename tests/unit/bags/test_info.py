"""The text of ``ros2 bag info``, against the layout of rosbag2_py/format_bag_metadata.cpp in Jazzy."""

import shutil
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from ruamel.yaml import YAML

from relform_bags.info import format_information, read_information
from relform_bags.metadata import METADATA_FILE
from relform_bags.split_limits import SplitLimits
from relform_bags.writer import BagWriter
from relform_core.errors import BagError

START_NS = 1_700_000_000_250_000_000
S = 1_000_000_000


@pytest.fixture(autouse=True)
def utc(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.setenv("TZ", "UTC")
    time.tzset()
    yield
    monkeypatch.undo()
    time.tzset()


@pytest.fixture
def bag(tmp_path: Path) -> Path:
    folder = tmp_path / "run/bag"
    with BagWriter(folder, {}, SplitLimits(duration_s=2)) as writer:
        for topic in ("/clock", "/other"):
            writer.add_topic(topic, "rosgraph_msgs/msg/Clock", [])
        for index in range(4):
            writer.write("/clock", bytes(12), START_NS + index * S, 0)
    return folder


def text_of(path: Path) -> str:
    return format_information(read_information(path))


EXPECTED = """
Files:             bag_0.mcap
                   bag_1.mcap
Bag size:          {size}
Storage id:        mcap
ROS Distro:        jazzy
Duration:          3.000000000s
Start:             Nov 14 2023 22:13:20.250000000 (1700000000.250000000)
End:               Nov 14 2023 22:13:23.250000000 (1700000003.250000000)
Messages:          4
Topic information: Topic: /clock | Type: rosgraph_msgs/msg/Clock | Count: 4 | Serialization Format: cdr
                   Topic: /other | Type: rosgraph_msgs/msg/Clock | Count: 0 | Serialization Format: cdr
Service:           0
Service information: """


def test_layout(bag: Path) -> None:
    size = sum(path.stat().st_size for path in bag.iterdir())
    assert text_of(bag) == text_of(bag.parent) == EXPECTED.format(size=f"{size / 1024:.1f} KiB")


def test_bag_without_metadata_yaml(bag: Path) -> None:
    (bag / METADATA_FILE).unlink()
    last = bag / "bag_1.mcap"
    closed = read_information(bag)
    assert closed.is_closed
    last.write_bytes(last.read_bytes()[:-9])
    cut = read_information(bag)
    assert not cut.is_closed
    assert cut.content["message_count"] == closed.content["message_count"] == 4
    assert "Topic: /clock | Type: rosgraph_msgs/msg/Clock | Count: 4 |" in text_of(bag)
    assert "Messages:          1\n" in text_of(last)


def test_service_events_are_listed_as_services(bag: Path) -> None:
    yaml = YAML()
    tree = yaml.load(bag / METADATA_FILE)
    topic = tree["rosbag2_bagfile_information"]["topics_with_message_count"][0]["topic_metadata"]
    topic["name"], topic["type"] = "/ask/_service_event", "some_srvs/srv/Ask_Event"
    yaml.dump(tree, bag / METADATA_FILE)
    text = text_of(bag)
    assert "Messages:          0\nTopic information: Topic: /other |" in text
    assert text.endswith(
        "Service:           1\nService information: Service: /ask/_service_event | "
        "Type: some_srvs/srv/Ask_Event | Event Count: 4 | Serialization Format: cdr"
    )


@pytest.mark.parametrize("content", ["", "a: [", "a: 3", "rosbag2_bagfile_information: {version: 9}", "\0"])
def test_unusable_metadata_yaml(bag: Path, content: str) -> None:
    (bag / METADATA_FILE).write_text(content)
    with pytest.raises(BagError, match=r"metadata\.yaml: not the metadata of a bag$"):
        read_information(bag)


def test_no_bag(tmp_path: Path) -> None:
    with pytest.raises(BagError, match="not a bag: the folder has no"):
        read_information(tmp_path)


@pytest.mark.parametrize(
    ("size", "text"), [(1023, "1023 B"), (1024, "1.0 KiB"), (1_500_000, "1.4 MiB"), (5 << 40, "5.0 TiB")]
)
def test_sizes(bag: Path, size: int, text: str, monkeypatch: pytest.MonkeyPatch) -> None:
    information = read_information(bag)
    object.__setattr__(information, "size", size)
    assert f"Bag size:          {text}\n" in format_information(information)


def test_recorded_flight(tmp_path: Path) -> None:
    folder = tmp_path / "copy"
    shutil.copytree(Path(__file__).parents[2] / "data/short_flight", folder)
    text = text_of(folder)
    assert "Duration:          2.000000000s\n" in text
    assert "Topic: /leader/imu | Type: sensor_msgs/msg/Imu | Count: 41 |" in text
