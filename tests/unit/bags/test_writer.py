"""Failures while a bag is written: one line each, and no loss of flushed messages."""

import errno
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from relform_bags import writer as bag_writer
from relform_bags.metadata import METADATA_FILE
from relform_bags.reader import BagAttachment, BagMessage, find_bag, read_bag
from relform_bags.recover import recover_bag
from relform_bags.writer import RESERVE_BYTES, BagWriter
from relform_core.errors import BagError

CLOCK_TYPE = "rosgraph_msgs/msg/Clock"
CLOCK_DATA = b"\x00\x01\x00\x00\x07\x00\x00\x00\x08\x00\x00\x00"


def messages(file: Path) -> list[BagMessage]:
    return [entry for entry in read_bag(file) if isinstance(entry, BagMessage)]


def started(folder: Path) -> BagWriter:
    writer = BagWriter(folder, {"config.yaml": "seed: 3\n"})
    writer.add_topic("/clock", CLOCK_TYPE, [])
    return writer


def test_flushed_messages_and_attachments_outlive_the_writer(tmp_path: Path) -> None:
    writer = started(tmp_path / "bag")
    for number in range(5):
        writer.write("/clock", CLOCK_DATA, number, 1000 + number)
    writer.flush()
    writer.write("/clock", CLOCK_DATA, 5, 1005)
    entries = list(read_bag(writer.file))
    assert entries[0] == BagAttachment("config.yaml", "seed: 3\n")
    assert entries[1:] == [BagMessage("/clock", CLOCK_TYPE, CLOCK_DATA, n, 1000 + n) for n in range(5)]
    writer.close()
    assert len(messages(writer.file)) == 6


def test_large_chunk_is_flushed_automatically(tmp_path: Path) -> None:
    writer = started(tmp_path / "bag")
    writer.write("/clock", bytes(bag_writer.CHUNK_BYTES + 1), 0, 0)
    assert len(messages(writer.file)) == 1
    writer.close()


def test_closed_bag_has_only_its_file_and_metadata(tmp_path: Path) -> None:
    writer = started(tmp_path / "flight")
    assert sum(path.stat().st_size for path in writer.folder.iterdir()) > RESERVE_BYTES
    writer.close()
    writer.close()
    assert sorted(path.name for path in writer.folder.iterdir()) == ["flight_0.mcap", METADATA_FILE]


def test_reading_of_chosen_topics(tmp_path: Path) -> None:
    with started(tmp_path / "bag") as writer:
        writer.add_topic("/other", CLOCK_TYPE, [])
        writer.write("/clock", CLOCK_DATA, 0, 0)
        writer.write("/other", CLOCK_DATA, 0, 0)
    read = [
        entry.topic for entry in read_bag(writer.file, topics=["/other"]) if isinstance(entry, BagMessage)
    ]
    assert read == ["/other"]


def test_existing_folder_is_refused(tmp_path: Path) -> None:
    (tmp_path / "bag").mkdir()
    (tmp_path / "bag/precious").write_text("data")
    with pytest.raises(
        BagError, match=f"^{re.escape(str(tmp_path / 'bag'))}: exists already; choose another folder"
    ):
        started(tmp_path / "bag")
    assert [path.name for path in (tmp_path / "bag").iterdir()] == ["precious"]


def test_folder_that_cannot_be_created(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    folder = tmp_path / "file/bag"
    with pytest.raises(BagError, match=f"^{re.escape(str(folder))}: cannot be created: Not a directory$"):
        started(folder)


@pytest.mark.parametrize("name", ["nowhere_msgs/msg/Clock", "rosgraph_msgs/msg/Watch"])
def test_type_that_is_not_installed(tmp_path: Path, name: str) -> None:
    with started(tmp_path / "bag") as writer, pytest.raises(BagError, match=f"^message type '{name}'"):
        writer.add_topic("/topic", name, [])


class TinyDisk:
    """Makes `os.write` fail as on a full disk when the files in a folder have reached a capacity."""

    def __init__(self, folder: Path, capacity: int, monkeypatch: pytest.MonkeyPatch) -> None:
        self.folder = folder
        self.capacity = capacity
        self.write = os.write
        monkeypatch.setattr(os, "write", self.limited_write)

    def limited_write(self, fd: int, data: bytes) -> int:
        if not os.readlink(f"/proc/self/fd/{fd}").startswith(str(self.folder)):
            return self.write(fd, data)
        used = sum(path.stat().st_size for path in self.folder.iterdir())
        room = max(0, self.capacity - used)
        if room == 0:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return self.write(fd, bytes(data)[:room])


def write_until_full(writer: BagWriter) -> int:
    """Write messages with log times 0, 1, 2 and so on until the disk is full; returns their number."""
    for number in range(10_000):
        try:
            writer.write("/clock", os.urandom(1000), number, number)
            if number % 7 == 0:
                writer.flush()
        except BagError:
            return number + 1
    raise AssertionError("the disk is not full")


def full_disk_summary(writer: BagWriter) -> str:
    """The report of closing the bag, without the reason."""
    with pytest.raises(BagError) as error:
        writer.close()
    text = str(error.value)
    prefix = f"{writer.file} cannot be written any more: No space left on device; "
    assert text.startswith(prefix)
    writer.close()  # no second error
    return text.removeprefix(prefix)


def test_full_disk_loses_no_message(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    writer = started(tmp_path / "bag")
    TinyDisk(writer.folder, RESERVE_BYTES + 20_000, monkeypatch)
    number = write_until_full(writer)
    for later in range(number, number + 30):  # they arrive until the recorder closes the bag
        writer.write("/clock", os.urandom(1000), later, later)
    last = f"0.{number + 29:09}".rstrip("0")
    assert full_disk_summary(writer) == f"the bag holds every message before {last} s"
    assert [entry.log_time_ns for entry in messages(writer.file)] == list(range(number + 30))
    assert recover_bag(writer.folder) is False, "it is complete"
    assert not (writer.folder / ".reserve").exists()


def test_disk_that_is_full_at_the_end_is_no_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    writer = started(tmp_path / "bag")
    for number in range(30):
        writer.write("/clock", os.urandom(1000), number, number)
    TinyDisk(writer.folder, RESERVE_BYTES + 10_000, monkeypatch)
    writer.close()
    assert len(messages(writer.file)) == 30
    assert recover_bag(writer.folder) is False


def test_reserve_that_cannot_grow_is_a_full_disk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    writer = started(tmp_path / "bag")

    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "posix_fallocate", full)
    number = write_until_full(writer)
    assert number > 3000, "it grows with the index, which is small"
    full_disk_summary(writer)
    assert len(messages(writer.file)) == number


def test_message_larger_than_the_reserve_is_lost_and_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    writer = started(tmp_path / "bag")
    TinyDisk(writer.folder, RESERVE_BYTES + 20_000, monkeypatch)
    number = write_until_full(writer)
    writer.flush()
    writer.write("/clock", os.urandom(2 * RESERVE_BYTES), number - 3, 0)
    writer.write("/clock", os.urandom(10), number + 1, 0)
    time = f"0.{number - 3:09}".rstrip("0")
    assert full_disk_summary(writer) == f"the bag holds every message before {time} s"
    assert [entry.log_time_ns for entry in messages(writer.file)] == list(range(number))
    assert recover_bag(writer.folder) is False, "it is complete"


LIMITED = """
import resource, sys
from pathlib import Path
from relform_core.errors import BagError
from relform_bags.writer import BagWriter

resource.setrlimit(resource.RLIMIT_FSIZE, (800_000, 800_000))
writer = BagWriter(Path(sys.argv[1]), {})
writer.add_topic("/clock", "rosgraph_msgs/msg/Clock", [])
number = 0
try:
    while number < 1000:
        number += 1
        writer.write("/clock", bytes(range(256)) * 20 + number.to_bytes(4) * 250, number, number)
        writer.write("/clock", __import__("os").urandom(5000), number, number)
        if number % int(sys.argv[2]) == 0:
            writer.flush()
except BagError as error:
    print(error)
for later in range(number, number + 3):
    writer.write("/clock", bytes(100), later, later)
try:
    writer.close()
except BagError as error:
    print(error)
"""


@pytest.mark.parametrize("messages_per_chunk", [2, 6])
def test_limit_of_the_file_size_loses_the_last_chunk_and_names_it(
    tmp_path: Path, messages_per_chunk: int
) -> None:
    """The index fits into the room of a lost long chunk, but not into that of a short one."""
    folder = tmp_path / "bag"
    command = [sys.executable, "-c", LIMITED, str(folder), str(messages_per_chunk // 2)]
    run = subprocess.run(command, capture_output=True, text=True, check=True)
    problem, summary = run.stdout.splitlines()
    is_complete = messages_per_chunk == 6
    file = folder / "bag_0.mcap"
    assert problem == f"{file} cannot be written any more: File too large"
    kept = [entry.log_time_ns for entry in messages(file)]
    assert len(kept) > 100
    first_lost = f"0.{max(kept) + 1:09}".rstrip("0")
    way_out = "" if is_complete else f"; complete it with scripts/record.py --recover {folder}"
    assert summary == f"{problem}; the bag holds every message before {first_lost} s{way_out}"
    assert kept == [number for number in range(1, max(kept) + 1) for _ in range(2)]
    assert recover_bag(folder) is not is_complete
    assert [entry.log_time_ns for entry in messages(file)] == kept


def test_bag_is_found_by_file_folder_or_run(tmp_path: Path) -> None:
    started(tmp_path / "run/bag").close()
    file = tmp_path / "run/bag/bag_0.mcap"
    assert find_bag(file) == find_bag(file.parent) == find_bag(tmp_path / "run") == file


@pytest.mark.parametrize(
    ("make", "expected"),
    [
        (lambda path: None, "no such file or folder"),
        (lambda path: path.mkdir(), "not a bag: the folder has no .mcap file"),
        (
            lambda path: (path.mkdir(), (path / "a.mcap").touch(), (path / "b.mcap").touch()),
            "its 2 .mcap files belong to several bags",
        ),
    ],
)
def test_path_without_a_bag(tmp_path: Path, make: object, expected: str) -> None:
    path = tmp_path / "place"
    make(path)
    with pytest.raises(BagError, match=f"^{re.escape(str(path))}: {expected}"):
        find_bag(path)


@pytest.mark.parametrize(
    ("content", "why"), [(b"", ": it is empty"), (b"name: paper\n", ""), (bytes(100), "")]
)
def test_file_that_is_not_mcap(tmp_path: Path, content: bytes, why: str) -> None:
    path = tmp_path / "bag_0.mcap"
    path.write_bytes(content)
    with pytest.raises(BagError, match=f"^{re.escape(str(path))}: not an MCAP file{why}$"):
        list(read_bag(path))
    with pytest.raises(BagError, match=f"^{re.escape(str(path))}: not an MCAP file{why}$"):
        recover_bag(tmp_path)


def test_nothing_to_recover(tmp_path: Path) -> None:
    with pytest.raises(BagError, match="not a bag: the folder has no"):
        recover_bag(tmp_path)
