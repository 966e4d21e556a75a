"""Write one MCAP file of a bag, with the records that rosbag2 writes."""

import os
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import BinaryIO, cast

from mcap.writer import CompressionType, Writer

from relform_bags.message_types import message_type
from relform_bags.metadata import NO_TIME_NS, FileContent, RecordedTopic, to_yaml
from relform_bags.recording_lock import hold

METADATA_RECORD = "rosbag2"
METADATA_KEY = "serialized_metadata"
MESSAGE_BYTES = 31 + 16
"""Size of a message beside its data: head of its record, and its entry in the index of the chunk."""
CHUNK_INDEX_BYTES = 100
CHANNEL_INDEX_BYTES = 10
"""Size of the index of a chunk at the end of the file: of itself and, for each topic, of one entry."""
CHANNEL_BYTES = 100
"""Size of what the end of a bag says about a topic, beside its texts."""
CHANNEL_COPIES = 4
"""The end of a bag repeats these texts in the index, in a metadata record and, indented, in metadata.yaml."""


class BagFileWriter:
    """One file, from its creation to ``finish``; every method raises OSError if it cannot write."""

    def __init__(
        self,
        path: Path,
        attachments: Mapping[str, str],
        information_yaml: str,
        make_room: Callable[[OSError], bool],
    ) -> None:
        """Create the file.

        Args:
            path: must not exist.
            attachments: texts to attach, by name.
            information_yaml: metadata of the bag so far.
            make_room: called after a write that failed; returns whether to try it once more.
        """
        self.path = path
        self.open_bytes = 0
        """Uncompressed size of the open chunk, which is not in the file yet."""
        self.open_start_ns: int | None = None
        """Least log time in the open chunk; None: it has no message."""
        self.index_bytes = 0
        """Upper bound of what finishing the file and the bag would write now, beside the open chunk."""
        self._schemas: dict[str, int] = {}
        self._channels: dict[str, int] = {}
        self._counts: dict[str, int] = {}
        self._start_ns = NO_TIME_NS
        self._end_ns = -NO_TIME_NS
        self._stream = _WholeChunks(path, make_room)
        # Only `flush` ends a chunk: mcap's own limit is out of reach.
        self._mcap = Writer(
            cast(BinaryIO, self._stream),  # it uses only write, tell and flush
            chunk_size=sys.maxsize,
            compression=CompressionType.ZSTD,
        )
        try:
            self._begin(attachments, information_yaml)
        except OSError:
            self.abandon()
            raise

    @property
    def size(self) -> int:
        """Bytes in the file."""
        return self._stream.size

    @property
    def start_ns(self) -> int | None:
        """Least log time; None before the first message."""
        return None if self._start_ns == NO_TIME_NS else self._start_ns

    @property
    def content(self) -> FileContent:
        """Content so far, the open chunk included."""
        if self.start_ns is None:
            return FileContent(self.path.name, dict(self._counts))
        return FileContent(self.path.name, dict(self._counts), self._start_ns, self._end_ns)

    def add_topic(self, topic: RecordedTopic) -> None:
        """Declare a topic before its first message."""
        if topic.type_name not in self._schemas:
            definition = message_type(topic.type_name).definition.encode()
            self._schemas[topic.type_name] = self._mcap.register_schema(
                topic.type_name, "ros2msg", definition
            )
            self.index_bytes += len(definition)
        offered_qos_yaml = to_yaml(topic.offered_qos)
        self._channels[topic.name] = self._mcap.register_channel(
            topic.name,
            "cdr",
            self._schemas[topic.type_name],
            {"offered_qos_profiles": offered_qos_yaml, "topic_type_hash": topic.type_hash},
        )
        texts = (topic.name, topic.type_name, topic.type_hash, offered_qos_yaml)
        self.index_bytes += CHANNEL_COPIES * (CHANNEL_BYTES + sum(map(len, texts)))
        self._counts[topic.name] = 0

    def write(self, topic: str, data: bytes, log_time_ns: int, publish_time_ns: int) -> None:
        """Add a serialized message to the open chunk."""
        self._mcap.add_message(self._channels[topic], log_time_ns, data, publish_time_ns)
        self._counts[topic] += 1
        self._start_ns = min(self._start_ns, log_time_ns)
        self._end_ns = max(self._end_ns, log_time_ns)
        self.open_bytes += MESSAGE_BYTES + len(data)
        if self.open_start_ns is None or log_time_ns < self.open_start_ns:
            self.open_start_ns = log_time_ns

    def flush(self) -> None:
        """Write the open chunk into the file; the end of the process cannot lose it then."""
        if self.open_bytes:
            self.index_bytes += CHUNK_INDEX_BYTES + CHANNEL_INDEX_BYTES * len(self._channels)
        self._mcap.flush()
        self.open_bytes = 0
        self.open_start_ns = None

    def finish(self, information_yaml: str) -> None:
        """Write the metadata of the bag and the index, then close the file."""
        self._add_information(information_yaml)
        self._mcap.finish()
        self._stream.flush()
        self.open_bytes = 0
        self.open_start_ns = None
        self._stream.close()

    def abandon(self) -> None:
        """Close the file as it is; does nothing on a finished file."""
        self._stream.close()

    def _begin(self, attachments: Mapping[str, str], information_yaml: str) -> None:
        self._mcap.start(profile="ros2", library="relform")
        for name, text in attachments.items():
            media_type = "application/json" if name.endswith(".json") else "text/plain"
            self._mcap.add_attachment(0, 0, name, media_type, text.encode())
        self._add_information(information_yaml)
        self._mcap.flush()

    def _add_information(self, information_yaml: str) -> None:
        self._mcap.add_metadata(METADATA_RECORD, {METADATA_KEY: information_yaml})


class _WholeChunks:
    """A file for mcap's writer: the bytes between two flushes reach the file all or not at all."""

    def __init__(self, path: Path, make_room: Callable[[OSError], bool]) -> None:
        self._fd: int | None = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o666)
        hold(self._fd)
        self.size = 0
        self._make_room = make_room
        self._pending = bytearray()

    def write(self, data: bytes) -> int:
        self._pending += data
        return len(data)

    def tell(self) -> int:
        return self.size + len(self._pending)

    def flush(self) -> None:
        try:
            self._write_pending()
        except OSError as error:
            if not self._make_room(error):
                raise
            self._write_pending()

    def _write_pending(self) -> None:
        assert self._fd is not None
        rest = memoryview(bytes(self._pending))
        try:
            while rest:
                rest = rest[os.write(self._fd, rest) :]
        except OSError:
            os.ftruncate(self._fd, self.size)
            os.lseek(self._fd, self.size, os.SEEK_SET)
            raise
        self.size += len(self._pending)
        self._pending.clear()

    def close(self) -> None:
        if self._fd is not None:
            os.close(self._fd)
            self._fd = None
