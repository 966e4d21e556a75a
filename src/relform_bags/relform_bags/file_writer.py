"""Write one MCAP file of a bag, with what rosbag2 puts into it."""

import os
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import BinaryIO, cast

from mcap.writer import CompressionType, Writer

from relform_bags.message_types import message_type
from relform_bags.metadata import NO_TIME_NS, FileContent, RecordedTopic, to_yaml

METADATA_RECORD = "rosbag2"
METADATA_KEY = "serialized_metadata"


class BagFileWriter:
    """One file, from its creation to ``finish``; every method raises OSError if it cannot be written."""

    def __init__(self, path: Path, attachments: Mapping[str, str], information_yaml: str) -> None:
        """Create the file.

        Args:
            path: must not exist.
            attachments: texts to keep in it, by name.
            information_yaml: what the bag holds so far.
        """
        self.path = path
        self.open_bytes = 0
        """Of messages that are not in the file yet."""
        self._schemas: dict[str, int] = {}
        self._channels: dict[str, int] = {}
        self._counts: dict[str, int] = {}
        self._start_ns = NO_TIME_NS
        self._end_ns = -NO_TIME_NS
        self._stream = _WholeChunks(path)
        # Chunks end where `flush` says; mcap's own limit never ends them in between.
        self._mcap = Writer(
            cast(BinaryIO, self._stream),  # write, tell and flush are all that it needs
            chunk_size=sys.maxsize,
            compression=CompressionType.ZSTD,
        )
        self._mcap.start(profile="ros2", library="relform")
        for name, text in attachments.items():
            media_type = "application/json" if name.endswith(".json") else "text/plain"
            self._mcap.add_attachment(0, 0, name, media_type, text.encode())
        self._add_information(information_yaml)
        self._mcap.flush()

    @property
    def size(self) -> int:
        """Bytes that are in the file."""
        return self._stream.size

    @property
    def start_ns(self) -> int | None:
        """Least log time; None before the first message."""
        return None if self._start_ns == NO_TIME_NS else self._start_ns

    @property
    def content(self) -> FileContent:
        """What was written so far."""
        if self.start_ns is None:
            return FileContent(self.path.name, dict(self._counts))
        return FileContent(self.path.name, dict(self._counts), self._start_ns, self._end_ns)

    def add_topic(self, topic: RecordedTopic) -> None:
        """Declare a topic before its first message."""
        if topic.type_name not in self._schemas:
            self._schemas[topic.type_name] = self._mcap.register_schema(
                topic.type_name, "ros2msg", message_type(topic.type_name).definition.encode()
            )
        self._channels[topic.name] = self._mcap.register_channel(
            topic.name,
            "cdr",
            self._schemas[topic.type_name],
            {"offered_qos_profiles": to_yaml(topic.offered_qos), "topic_type_hash": topic.type_hash},
        )
        self._counts[topic.name] = 0

    def write(self, topic: str, data: bytes, log_time_ns: int, publish_time_ns: int) -> None:
        """Add a serialized message to the open chunk."""
        self._mcap.add_message(self._channels[topic], log_time_ns, data, publish_time_ns)
        self._counts[topic] += 1
        self._start_ns = min(self._start_ns, log_time_ns)
        self._end_ns = max(self._end_ns, log_time_ns)
        self.open_bytes += len(data)

    def flush(self) -> None:
        """Finish the open chunk, so that it outlives the process."""
        self._mcap.flush()
        self.open_bytes = 0

    def finish(self, information_yaml: str) -> None:
        """Write what the bag holds and the index, then close the file."""
        self._add_information(information_yaml)
        self._mcap.finish()
        self._stream.flush()
        self._stream.close()

    def abandon(self) -> None:
        """Close the file as it is; does nothing if it was finished."""
        self._stream.close()

    def _add_information(self, information_yaml: str) -> None:
        self._mcap.add_metadata(METADATA_RECORD, {METADATA_KEY: information_yaml})


class _WholeChunks:
    """A file for mcap's writer: everything between two flushes gets there, or nothing of it."""

    def __init__(self, path: Path) -> None:
        self._fd: int | None = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o666)
        self.size = 0
        self._pending = bytearray()

    def write(self, data: bytes) -> int:
        self._pending += data
        return len(data)

    def tell(self) -> int:
        return self.size + len(self._pending)

    def flush(self) -> None:
        assert self._fd is not None
        rest = memoryview(bytes(self._pending))
        try:
            while rest:
                rest = rest[os.write(self._fd, rest) :]
        except OSError:
            os.ftruncate(self._fd, self.size)
            raise
        self.size += len(self._pending)
        self._pending.clear()

    def close(self) -> None:
        if self._fd is not None:
            os.close(self._fd)
            self._fd = None
