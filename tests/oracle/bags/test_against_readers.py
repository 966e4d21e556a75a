"""Our bags, read by rosbags and mcap-ros2-support, which share no code with the writer."""

from pathlib import Path
from typing import Any

import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.interfaces import MessageDefinitionFormat, QosDurability, QosReliability
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from ruamel.yaml import YAML

from relform_bags.message_types import message_type
from relform_bags.metadata import NO_TIME_NS
from relform_bags.writer import BagWriter
from support.bags import TOPICS, same, typestore, write_bag

NUMBER = 40


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, list[Any]]]:
    folder = tmp_path_factory.mktemp("run") / "bag"
    return folder, write_bag(folder, NUMBER, flush_every=7)


def test_rosbags_reads_every_message(bag: tuple[Path, dict[str, list[Any]]]) -> None:
    folder, written = bag
    read: dict[str, list[Any]] = {topic: [] for topic in TOPICS}
    with Reader(folder) as reader:
        # The types come from the bag, not from the installed packages.
        store = get_typestore(Stores.EMPTY)
        for connection in reader.connections:
            assert connection.msgdef.format == MessageDefinitionFormat.MSG
            store.register(get_types_from_msg(connection.msgdef.data, connection.msgtype))
        for connection, log_ns, data in reader.messages():
            read[connection.topic].append((store.deserialize_cdr(data, connection.msgtype), log_ns))
        assert reader.message_count == NUMBER * len(TOPICS)
        assert {c.topic: c.msgcount for c in reader.connections} == dict.fromkeys(TOPICS, NUMBER)
        assert (reader.start_time, reader.end_time) == (0, 50_000_000 * (NUMBER - 1) + 1)
    for topic, messages in written.items():
        assert [log_ns for _, log_ns in read[topic]] == [log_ns for _, log_ns, _ in messages]
        assert all(same(sent, got) for (sent, _, _), (got, _) in zip(messages, read[topic], strict=True))


def test_mcap_ros2_support_reads_every_message(bag: tuple[Path, dict[str, list[Any]]]) -> None:
    folder, written = bag
    read: dict[str, list[Any]] = {topic: [] for topic in TOPICS}
    with (folder / "bag_0.mcap").open("rb") as file:
        for entry in make_reader(file, decoder_factories=[DecoderFactory()]).iter_decoded_messages():
            read[entry.channel.topic].append(entry)
    for topic, messages in written.items():
        assert len(read[topic]) == NUMBER
        for (sent, log_ns, publish_ns), got in zip(messages, read[topic], strict=True):
            assert same(sent, got.decoded_message)
            assert (got.message.log_time, got.message.publish_time) == (log_ns, publish_ns)
            assert got.message.sequence == 0


def test_types_and_hashes_are_those_that_rosbags_computes() -> None:
    for type_name, _ in TOPICS.values():
        assert message_type(type_name).type_hash == typestore().hash_rihs01(type_name)


def test_quality_of_service(bag: tuple[Path, dict[str, list[Any]]]) -> None:
    with Reader(bag[0]) as reader:
        offered = {c.topic: c.ext.offered_qos_profiles for c in reader.connections}
    assert [len(offered[topic]) for topic in TOPICS] == [1, 1, 1, 2, 0]
    (clock,) = offered["/clock"]
    assert (clock.reliability, clock.durability) == (QosReliability.RELIABLE, QosDurability.VOLATILE)
    assert (clock.deadline.sec, clock.deadline.nsec) == (9223372036, 854775807)
    assert offered["/formation/events"][0].durability == QosDurability.TRANSIENT_LOCAL


def test_mcap_index(bag: tuple[Path, dict[str, list[Any]]]) -> None:
    folder, _ = bag
    with (folder / "bag_0.mcap").open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        assert reader.get_header().profile == "ros2"
        summary = reader.get_summary()
        assert summary is not None
        assert summary.statistics is not None
        assert summary.statistics.message_count == NUMBER * len(TOPICS)
        assert len(summary.chunk_indexes) == summary.statistics.chunk_count >= NUMBER // 7
        assert {chunk.compression for chunk in summary.chunk_indexes} == {"zstd"}
        assert sum(1 for _ in reader.iter_messages()) == NUMBER * len(TOPICS)
        assert {a.name: a.data for a in reader.iter_attachments()} == {
            "config.yaml": b"name: test\n",
            "versions.json": b"{}",
        }
        (*_, last) = (entry.metadata for entry in reader.iter_metadata() if entry.name == "rosbag2")
    in_file = YAML(typ="safe", pure=True).load(last["serialized_metadata"])
    beside = YAML(typ="safe", pure=True).load((folder / "metadata.yaml").read_text())
    assert {"rosbag2_bagfile_information": in_file} == beside


def test_metadata_yaml_is_that_of_rosbag2_jazzy(bag: tuple[Path, dict[str, list[Any]]]) -> None:
    information = YAML(typ="safe", pure=True).load((bag[0] / "metadata.yaml").read_text())[
        "rosbag2_bagfile_information"
    ]
    # The keys in the order in which rosbag2 0.26 writes them.
    assert list(information) == [
        "version",
        "storage_identifier",
        "duration",
        "starting_time",
        "message_count",
        "topics_with_message_count",
        "compression_format",
        "compression_mode",
        "relative_file_paths",
        "files",
        "custom_data",
        "ros_distro",
    ]
    assert information["version"] == 9
    assert information["storage_identifier"] == "mcap"
    assert information["duration"] == {"nanoseconds": 50_000_000 * (NUMBER - 1)}
    assert information["starting_time"] == {"nanoseconds_since_epoch": 0}
    assert (information["compression_format"], information["compression_mode"]) == ("", "")
    assert information["relative_file_paths"] == ["bag_0.mcap"]
    assert information["files"] == [
        {
            "path": "bag_0.mcap",
            "starting_time": {"nanoseconds_since_epoch": 0},
            "duration": {"nanoseconds": 50_000_000 * (NUMBER - 1)},
            "message_count": NUMBER * len(TOPICS),
        }
    ]
    assert (information["custom_data"], information["ros_distro"]) == (None, "jazzy")
    topic = information["topics_with_message_count"][3]
    assert topic["message_count"] == NUMBER
    metadata = topic["topic_metadata"]
    assert (metadata["name"], metadata["type"]) == ("/formation/events", "relform_msgs/msg/FormationEvent")
    assert metadata["serialization_format"] == "cdr"
    assert metadata["type_description_hash"].startswith("RIHS01_")
    infinite = {"sec": 9223372036, "nsec": 854775807}
    assert metadata["offered_qos_profiles"][0] == {
        "history": "unknown",
        "depth": 0,
        "reliability": "reliable",
        "durability": "transient_local",
        "deadline": infinite,
        "lifespan": infinite,
        "liveliness": "automatic",
        "liveliness_lease_duration": infinite,
        "avoid_ros_namespace_conventions": False,
    }


def test_bag_without_messages(tmp_path: Path) -> None:
    with BagWriter(tmp_path / "empty", {}) as writer:
        writer.add_topic("/clock", "rosgraph_msgs/msg/Clock", [])
    with Reader(tmp_path / "empty") as reader:
        assert reader.message_count == 0
        assert list(reader.messages()) == []
    text = (tmp_path / "empty/metadata.yaml").read_text()
    start = YAML(typ="safe", pure=True).load(text)["rosbag2_bagfile_information"]["starting_time"]
    assert start == {"nanoseconds_since_epoch": NO_TIME_NS}  # as rosbag2
