"""Bags of several files: when the next file begins, and that our readers take all files as one bag."""

import os
from pathlib import Path

import pytest

from relform_bags.metadata import METADATA_FILE
from relform_bags.reader import BagAttachment, BagMessage, bag_files, find_bag, read_bag
from relform_bags.recover import recover_bag
from relform_bags.split_limits import SplitLimits
from relform_bags.writer import BagWriter
from relform_core.errors import BagError

CLOCK_TYPE = "rosgraph_msgs/msg/Clock"
S = 1_000_000_000
START_NS = 3 * S


def messages(path: Path) -> list[BagMessage]:
    return [entry for entry in read_bag(path) if isinstance(entry, BagMessage)]


def begun(folder: Path, limits: SplitLimits) -> BagWriter:
    writer = BagWriter(folder, {"config.yaml": "seed: 3\n"}, limits)
    for topic in ("/noise", "/latched"):
        writer.add_topic(topic, CLOCK_TYPE, [])
    return writer


def write_noise(writer: BagWriter, number: int, each_bytes: int = 200) -> list[BagMessage]:
    """Messages that cannot be compressed, two per second from START_NS on."""
    written = []
    for index in range(number):
        data, time_ns = os.urandom(each_bytes), START_NS + index * S // 2
        writer.write("/noise", data, time_ns, time_ns + 7)
        written.append(BagMessage("/noise", CLOCK_TYPE, data, time_ns, time_ns + 7))
    return written


def split_bag(folder: Path, duration_s: int = 2, number: int = 53) -> list[BagMessage]:
    with begun(folder, SplitLimits(duration_s=duration_s)) as writer:
        return write_noise(writer, number)


def test_file_ends_after_its_duration(tmp_path: Path) -> None:
    written = split_bag(tmp_path / "bag", duration_s=2)
    files = bag_files(tmp_path / "bag")
    assert [file.name for file in files] == [f"bag_{n}.mcap" for n in range(11)], "ten comes after nine"
    for index, file in enumerate(files):
        # As in rosbag2, a message at the limit still belongs to the file: five messages in two seconds.
        assert messages(file) == written[5 * index : 5 * index + 5]


def test_file_ends_at_its_size(tmp_path: Path) -> None:
    limit, each = 40_000, 1000
    with begun(tmp_path / "bag", SplitLimits(size=limit)) as writer:
        for _ in write_noise(writer, 10, each):
            writer.flush()
        written = messages(tmp_path / "bag")
        for index in range(90):
            writer.write("/noise", os.urandom(each), START_NS + (20 + index) * S, 0)
            writer.flush()
    *full, last = bag_files(tmp_path / "bag")
    assert len(full) >= 2
    for file in full:
        index_bytes = 10_000
        assert limit <= file.stat().st_size < limit + 2 * each + index_bytes
    assert last.stat().st_size < limit + index_bytes
    assert messages(tmp_path / "bag")[:10] == written
    assert len(messages(tmp_path / "bag")) == 100


def test_chunks_are_within_a_small_size_limit(tmp_path: Path) -> None:
    with begun(tmp_path / "bag", SplitLimits(size=8000)) as writer:
        write_noise(writer, 100, 1000)
    assert len(bag_files(tmp_path / "bag")) > 5


def test_every_file_takes_at_least_one_message(tmp_path: Path) -> None:
    with begun(tmp_path / "bag", SplitLimits(size=1024)) as writer:
        write_noise(writer, 4, 2000)
    assert [len(messages(file)) for file in bag_files(tmp_path / "bag")] == [1, 1, 1, 1]


def test_split_bag_reads_as_one(tmp_path: Path) -> None:
    folder = tmp_path / "run/bag"
    written = split_bag(folder)
    assert find_bag(tmp_path / "run") == find_bag(folder) == folder
    assert list(read_bag(tmp_path / "run")) == [BagAttachment("config.yaml", "seed: 3\n"), *written]
    assert next(read_bag(folder / "bag_3.mcap")) == BagAttachment("config.yaml", "seed: 3\n")
    assert list(read_bag(folder, topics=["/latched"])) == [BagAttachment("config.yaml", "seed: 3\n")]


def test_latched_message_is_only_in_the_file_of_its_time(tmp_path: Path) -> None:
    with begun(tmp_path / "bag", SplitLimits(duration_s=2)) as writer:
        writer.write("/latched", b"\x00\x01\x00\x00once", START_NS, 0)
        write_noise(writer, 20)
    of_files = [[entry.topic for entry in messages(file)] for file in bag_files(tmp_path / "bag")]
    assert [topics.count("/latched") for topics in of_files] == [1, 0, 0, 0]


def test_recovery_of_a_split_bag(tmp_path: Path) -> None:
    folder = tmp_path / "bag"
    writer = begun(folder, SplitLimits(duration_s=2))
    written = write_noise(writer, 12)
    writer.flush()
    write_noise(writer, 1)  # stays in the open chunk
    assert messages(folder) == written
    assert recover_bag(folder) is True
    assert messages(folder) == written
    assert sorted(path.name for path in folder.iterdir()) == [
        *(f"bag_{n}.mcap" for n in range(3)),
        METADATA_FILE,
    ]
    assert recover_bag(folder) is False


def test_recovery_after_a_kill_at_the_start_of_a_file(tmp_path: Path) -> None:
    folder = tmp_path / "bag"
    written = split_bag(folder, number=10)
    (folder / "bag_2.mcap").touch()
    (folder / METADATA_FILE).unlink()
    assert messages(folder) == written
    assert recover_bag(folder) is True
    assert sorted(path.name for path in folder.iterdir()) == ["bag_0.mcap", "bag_1.mcap", METADATA_FILE]


def test_reading_ends_at_the_first_damaged_file(tmp_path: Path) -> None:
    written = split_bag(tmp_path / "bag", number=15)
    torn = tmp_path / "bag/bag_1.mcap"
    content = torn.read_bytes()
    torn.write_bytes(content[: len(content) // 4])
    assert messages(tmp_path / "bag") == written[:5], "the last file would leave a gap"


def test_disk_is_full_at_a_split(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = tmp_path / "bag"
    writer = begun(folder, SplitLimits(duration_s=2))
    written = write_noise(writer, 5)
    write = os.write

    def full(fd: int, data: bytes) -> int:
        if os.readlink(f"/proc/self/fd/{fd}").endswith("bag_1.mcap"):
            raise OSError(28, "No space left on device")
        return write(fd, data)

    monkeypatch.setattr(os, "write", full)
    with pytest.raises(BagError, match=r"bag_0\.mcap cannot be written any more: No space left on device$"):
        writer.write("/noise", b"", START_NS + 9 * S, 0)
    with pytest.raises(BagError, match=r"; the bag holds every message before 12 s$"):
        writer.close()
    assert messages(folder) == written
    assert sorted(path.name for path in folder.iterdir()) == ["bag_0.mcap", METADATA_FILE]


def test_missing_file_in_between_is_refused(tmp_path: Path) -> None:
    split_bag(tmp_path / "bag", number=20)
    (tmp_path / "bag/bag_2.mcap").unlink()
    for action in (messages, recover_bag):
        with pytest.raises(BagError, match=r"bag: bag_2\.mcap is missing"):
            action(tmp_path / "bag")


def test_first_files_may_be_deleted(tmp_path: Path) -> None:
    written = split_bag(tmp_path / "bag", number=20)
    (tmp_path / "bag/bag_0.mcap").unlink()
    assert messages(tmp_path / "bag") == written[5:]


@pytest.mark.parametrize(
    ("limits", "problem"),
    [
        ({"size": 1023}, r"max bag size must be at least 1024 bytes, or 0 for no limit \(got 1023\)"),
        ({"size": -1}, "max bag size"),
        ({"duration_s": -3}, r"max bag duration must be at least 1 s, or 0 for no limit \(got -3\)"),
    ],
)
def test_limit_out_of_bounds_is_refused(limits: dict[str, int], problem: str) -> None:
    with pytest.raises(BagError, match=problem):
        SplitLimits(**limits)
