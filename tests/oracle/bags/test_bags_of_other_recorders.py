"""Bags that other recorders have written, with the mcap library or with rosbags."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import lz4.frame
import pytest
import zstandard
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer
from rosbags.rosbag2 import CompressionMode, Reader

from relform_bags.foxglove.command import write_drawable_bag
from relform_bags.info import read_information
from relform_bags.message_types import message_class, message_type
from relform_bags.reader import BagAttachment, BagMessage, read_bag
from relform_bags.recover import recover_bag
from relform_core.errors import BagError
from support.bags import header, write_compressed_bag

TYPE = "std_msgs/msg/Header"
NUMBER = 40
START_NS = 1_700_000_000_000_000_000
FORMATS = {
    "chunks of lz4": {"compression": CompressionType.LZ4},
    "chunks that are not compressed": {"compression": CompressionType.NONE},
    "chunks without checksums": {"compression": CompressionType.ZSTD, "enable_crcs": False},
    "no chunks, as by the profile fastwrite of rosbag2": {"use_chunking": False},
}


def written() -> list[BagMessage]:
    return [BagMessage("/tick", TYPE, header(n), START_NS + n, START_NS + n - 5) for n in range(NUMBER)]


def sent() -> list[tuple[int, bytes]]:
    return [(message.log_time_ns, message.data) for message in written()]


def write_file(path: Path, **format_: Any) -> None:
    with path.open("wb") as stream:
        writer = Writer(stream, chunk_size=300, **format_)
        writer.start(profile="ros2")
        writer.add_attachment(0, 0, "camera.jpg", "image/jpeg", b"\xff\xd8\xff\xe0")
        writer.add_attachment(0, 0, "notes.txt", "text/plain", b"text")
        schema = writer.register_schema(TYPE, "ros2msg", message_type(TYPE).definition.encode())
        channel = writer.register_channel("/tick", "cdr", schema, {"offered_qos_profiles": ""})
        for message in written():
            writer.add_message(channel, message.log_time_ns, message.data, message.publish_time_ns)
        writer.finish()


@pytest.fixture(params=FORMATS)
def file(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    write_file(tmp_path / "recording.mcap", **FORMATS[request.param])
    return tmp_path / "recording.mcap"


def test_every_format_of_chunks_is_read(file: Path) -> None:
    assert list(read_bag(file)) == [BagAttachment("notes.txt", "text"), *written()]
    content = read_information(file).content
    assert content["message_count"] == NUMBER
    assert content["starting_time"] == {"nanoseconds_since_epoch": START_NS}
    assert content["duration"] == {"nanoseconds": NUMBER - 1}


def test_every_format_of_chunks_is_recovered(file: Path) -> None:
    content = file.read_bytes()
    file.write_bytes(content[: len(content) // 2])
    kept = [entry for entry in read_bag(file) if isinstance(entry, BagMessage)]
    assert 3 < len(kept) < NUMBER
    assert recover_bag(file) is True
    with file.open("rb") as stream:
        assert [message.data for _, _, message in make_reader(stream).iter_messages()] == [
            message.data for message in kept
        ]
    with Reader(file.parent) as reader:
        assert reader.message_count == len(kept)
    assert recover_bag(file) is False


def test_damage_in_a_chunk_of_lz4_ends_the_reading(tmp_path: Path) -> None:
    path = tmp_path / "recording.mcap"
    write_file(path, **FORMATS["chunks of lz4"])
    content = bytearray(path.read_bytes())
    second = content.index(lz4.frame.compress(b"")[:4], content.index(b"lz4") + 100)
    content[second : second + 20] = bytes(20)
    path.write_bytes(content)
    assert 0 < sum(isinstance(entry, BagMessage) for entry in read_bag(path)) < NUMBER


def test_unknown_compression_of_chunks_is_one_line(tmp_path: Path) -> None:
    path = tmp_path / "recording.mcap"
    write_file(path, **FORMATS["chunks of lz4"])
    path.write_bytes(path.read_bytes().replace(b"\x03\x00\x00\x00lz4", b"\x03\x00\x00\x00br1"))
    with pytest.raises(BagError, match=r"recording\.mcap: cannot be read: unknown compression 'br1'$"):
        list(read_bag(path))


def test_messages_that_are_not_of_ros_have_no_class(tmp_path: Path) -> None:
    path = tmp_path / "recording.mcap"
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        channel = writer.register_channel("/json", "json", schema_id=0)
        writer.add_message(channel, 1, b"{}", 1)
        writer.finish()
    (message,) = read_bag(path)
    assert message == BagMessage("/json", "", b"{}", 1, 1)
    with pytest.raises(BagError, match="'' is not the name of a ROS 2 message type"):
        message_class("")


@pytest.fixture(params=["message", "file"])
def compressed(request: pytest.FixtureRequest, tmp_path: Path) -> tuple[Path, str]:
    mode = CompressionMode[request.param.upper()]
    return write_compressed_bag(tmp_path / "bag", mode, sent()), request.param


READERS = {
    "read": lambda bag: list(read_bag(bag)),
    "info": read_information,
    "recover": recover_bag,
    "foxglove": lambda bag: write_drawable_bag(bag, bag / "drawable"),
}


@pytest.mark.parametrize("action", READERS.values(), ids=READERS)
def test_compressed_bag_is_refused_by_one_line(
    compressed: tuple[Path, str], action: Callable[[Path], object]
) -> None:
    bag, mode = compressed
    before = {path.name: path.read_bytes() for path in bag.iterdir()}
    with pytest.raises(BagError) as error:
        action(bag)
    (line,) = str(error.value).splitlines()
    assert line.startswith(str(bag))
    assert f"(rosbag2 compression mode {mode}) cannot be read; " in line
    assert {path.name: path.read_bytes() for path in bag.iterdir()} == before, "nothing was changed"


def test_file_compressed_as_a_whole_is_read_after_decompression(tmp_path: Path) -> None:
    bag = write_compressed_bag(tmp_path / "bag", CompressionMode.FILE, sent())
    (packed,) = bag.glob("*.mcap.*")
    with packed.open("rb") as stream:
        content = zstandard.ZstdDecompressor().stream_reader(stream).read()
    packed.with_suffix("").write_bytes(content)
    packed.unlink()
    assert list(read_bag(bag)) == [
        BagMessage(each.topic, each.type_name, each.data, each.log_time_ns, each.log_time_ns)
        for each in written()
    ]
