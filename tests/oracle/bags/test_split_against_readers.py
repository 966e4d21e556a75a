"""Our bags of several files, closed or recovered, read by rosbags and mcap-ros2-support."""

from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest
from mcap.exceptions import EndOfFile
from mcap.reader import NonSeekingReader, make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.rosbag2 import Reader
from ruamel.yaml import YAML

from relform_bags.metadata import METADATA_FILE, NO_TIME_NS
from relform_bags.reader import bag_files
from relform_bags.recover import recover_bag
from relform_bags.split_limits import SplitLimits
from support.bags import TOPICS, same, typestore, write_bag

NUMBER = 65
PERIOD_NS = 50_000_000
PER_FILE = 21
"""Messages of one topic in one second, both ends included."""
S = 1_000_000_000
Written = dict[str, list[Any]]


def information(folder: Path) -> dict[str, Any]:
    yaml = YAML(typ="safe", pure=True)
    return dict(yaml.load((folder / METADATA_FILE).read_text())["rosbag2_bagfile_information"])


@pytest.fixture(params=["closed", "recovered"])
def bag(request: pytest.FixtureRequest, tmp_path: Path) -> tuple[Path, Written]:
    folder = tmp_path / "bag"
    written = write_bag(folder, NUMBER, flush_every=4, limits=SplitLimits(duration_s=1))
    if request.param == "recovered":
        last = bag_files(folder)[-1]
        last.write_bytes(last.read_bytes()[:-300])
        before = information(folder)
        (folder / METADATA_FILE).unlink()
        assert recover_bag(folder) is True
        assert information(folder) == before
    return folder, written


def test_metadata_lists_every_file(bag: tuple[Path, Written]) -> None:
    written = information(bag[0])
    names = [f"bag_{n}.mcap" for n in range(4)]
    assert written["version"] == 9
    assert written["relative_file_paths"] == names
    assert written["files"] == [
        {
            "path": name,
            "starting_time": {"nanoseconds_since_epoch": index * PER_FILE * PERIOD_NS},
            "duration": {"nanoseconds": (number - 1) * PERIOD_NS},
            "message_count": number * len(TOPICS),
        }
        for index, (name, number) in enumerate(zip(names, [PER_FILE] * 3 + [2], strict=True))
    ]
    assert written["message_count"] == NUMBER * len(TOPICS)
    assert written["starting_time"] == {"nanoseconds_since_epoch": 0}
    assert written["duration"] == {"nanoseconds": (NUMBER - 1) * PERIOD_NS}
    topics = {each["topic_metadata"]["name"]: each for each in written["topics_with_message_count"]}
    assert {name: topic["message_count"] for name, topic in topics.items()} == dict.fromkeys(TOPICS, NUMBER)
    assert topics["/formation/events"]["topic_metadata"]["offered_qos_profiles"][1]["durability"] == (
        "transient_local"
    )


def test_rosbags_reads_it_as_one(bag: tuple[Path, Written]) -> None:
    folder, written = bag
    read: dict[str, list[Any]] = {topic: [] for topic in TOPICS}
    with Reader(folder) as reader:
        assert reader.message_count == NUMBER * len(TOPICS)
        for connection, log_ns, data in reader.messages():
            read[connection.topic].append((typestore().deserialize_cdr(data, connection.msgtype), log_ns))
    for topic, messages in written.items():
        assert [log_ns for _, log_ns in read[topic]] == [log_ns for _, log_ns, _ in messages]
        assert all(same(sent, got) for (sent, _, _), (got, _) in zip(messages, read[topic], strict=True))


def test_every_file_is_read_alone(bag: tuple[Path, Written]) -> None:
    folder, written = bag
    read: dict[str, list[Any]] = {topic: [] for topic in TOPICS}
    for path in bag_files(folder):
        with path.open("rb") as file:
            reader = make_reader(file, decoder_factories=[DecoderFactory()], validate_crcs=True)
            assert {attachment.name for attachment in reader.iter_attachments()} == {
                "config.yaml",
                "versions.json",
            }
            summary = reader.get_summary()
            assert summary is not None
            assert {channel.topic for channel in summary.channels.values()} == set(TOPICS)
            for entry in reader.iter_decoded_messages():
                read[entry.channel.topic].append(entry.decoded_message)
    for topic, messages in written.items():
        assert all(same(sent, got) for (sent, _, _), got in zip(messages, read[topic], strict=True))


def test_metadata_record_at_the_start_of_a_file(tmp_path: Path) -> None:
    folder = tmp_path / "bag"
    write_bag(folder, NUMBER, limits=SplitLimits(duration_s=1))
    with (folder / "bag_1.mcap").open("rb") as file:
        first, last = (
            YAML(typ="safe", pure=True).load(entry.metadata["serialized_metadata"])
            for entry in make_reader(file).iter_metadata()
            if entry.name == "rosbag2"
        )
    assert first["relative_file_paths"] == last["relative_file_paths"] == ["bag_0.mcap", "bag_1.mcap"]
    assert first["files"][1]["starting_time"] == {"nanoseconds_since_epoch": NO_TIME_NS}  # as rosbag2
    assert last["files"][1]["message_count"] == PER_FILE * len(TOPICS)
    assert last["message_count"] == 2 * PER_FILE * len(TOPICS)


def test_mcap_library_reads_a_torn_file_from_its_beginning(tmp_path: Path) -> None:
    """The library reads a bag that was not closed without an index."""
    folder = tmp_path / "bag"
    written = write_bag(folder, NUMBER, flush_every=5, limits=SplitLimits(duration_s=2))
    last = bag_files(folder)[-1]
    last.write_bytes(last.read_bytes()[: last.stat().st_size // 2])
    read = []
    with last.open("rb") as file, suppress(EndOfFile):
        reader = NonSeekingReader(file, decoder_factories=[DecoderFactory()])
        for entry in reader.iter_decoded_messages(topics=["/clock"], log_time_order=False):
            read.append(entry)
    assert 5 <= len(read) < NUMBER - 41
    for (sent, log_ns, _), got in zip(written["/clock"][41:], read, strict=False):
        assert same(sent, got.decoded_message)
        assert got.message.log_time == log_ns
