"""Write a bag that ros2 bag, rosbags, Foxglove and others read: a folder of one MCAP file and metadata.yaml.

A message is safe when its chunk has reached the file (``flush``): a process that dies afterwards does not
lose it, and a write that fails leaves the file as it was. A bag that was not closed needs ``recover_bag``.
"""

import os
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from types import TracebackType
from typing import BinaryIO, Self, cast

from mcap.writer import CompressionType, Writer

from relform_core.errors import BagError
from relform_tools.bag_metadata import (
    BagStatistics,
    OfferedQos,
    RecordedTopic,
    bag_information,
    to_yaml,
    write_metadata_yaml,
)
from relform_tools.bag_recover import RESERVE_FILE, recover_bag
from relform_tools.bag_types import message_type

CONFIG_ATTACHMENT = "config.yaml"
"""The effective configuration of a flight, seed included."""
VERSIONS_ATTACHMENT = "versions.json"
"""The software that flew and recorded it."""
CHUNK_BYTES = 256 * 1024
RESERVE_BYTES = 256 * 1024
"""Kept free beside the bag, so that a full disk leaves room for the index."""


class BagWriter:
    """One bag, from its creation to ``close``; a context manager."""

    def __init__(self, folder: Path, attachments: Mapping[str, str]) -> None:
        """Create the bag.

        Args:
            folder: folder of the bag, must not exist.
            attachments: texts to keep in the bag, by file name.
        Raises:
            BagError: the folder exists or cannot be written.
        """
        self.folder = folder
        self.file = folder / f"{folder.name}_0.mcap"
        self._reserve = folder / RESERVE_FILE
        self._topics: dict[str, RecordedTopic] = {}
        self._channels: dict[str, int] = {}
        self._schemas: dict[str, int] = {}
        self._counts: dict[str, int] = {}
        self._start_ns: int | None = None
        self._end_ns = 0
        self._open_bytes = 0
        try:
            folder.mkdir(parents=True)
            self._reserve.write_bytes(bytes(RESERVE_BYTES))
            self._stream: _WholeChunks | None = _WholeChunks(self.file)
            # Chunks end where `flush` says; mcap's own limit would end them in between.
            self._mcap = Writer(
                cast(BinaryIO, self._stream),  # write, tell and flush are all that it needs
                chunk_size=4 * CHUNK_BYTES,
                compression=CompressionType.ZSTD,
            )
            self._mcap.start(profile="ros2", library="relform")
            for name, text in attachments.items():
                media_type = "application/json" if name.endswith(".json") else "text/plain"
                self._mcap.add_attachment(0, 0, name, media_type, text.encode())
            self._add_information()
            self._mcap.flush()
        except FileExistsError:
            raise BagError(f"{folder} exists already, not overwriting; choose another folder") from None
        except OSError as error:
            raise BagError(f"{folder}: no bag can be written there: {error.strerror}") from None

    def add_topic(self, name: str, type_name: str, offered_qos: Sequence[OfferedQos]) -> None:
        """Declare a topic before its first message.

        Raises:
            BagError: its type is not installed.
        """
        description = message_type(type_name)
        if type_name not in self._schemas:
            self._schemas[type_name] = self._mcap.register_schema(
                type_name, "ros2msg", description.definition.encode()
            )
        topic = RecordedTopic(name, type_name, description.type_hash, [asdict(qos) for qos in offered_qos])
        self._channels[name] = self._mcap.register_channel(
            name,
            "cdr",
            self._schemas[type_name],
            {"offered_qos_profiles": to_yaml(topic.offered_qos), "topic_type_hash": topic.type_hash},
        )
        self._topics[name] = topic
        self._counts[name] = 0

    def write(self, topic: str, data: bytes, log_time_ns: int, publish_time_ns: int) -> None:
        """Add a serialized message.

        Raises:
            BagError: a chunk was due and could not be written; the bag is closed.
        """
        self._mcap.add_message(self._channels[topic], log_time_ns, data, publish_time_ns)
        self._counts[topic] += 1
        self._start_ns = log_time_ns if self._start_ns is None else min(self._start_ns, log_time_ns)
        self._end_ns = max(self._end_ns, log_time_ns)
        self._open_bytes += len(data)
        if self._open_bytes > CHUNK_BYTES:
            self.flush()

    def flush(self) -> None:
        """Finish the open chunk, so that it outlives the process.

        Raises:
            BagError: it could not be written; the bag is closed.
        """
        try:
            self._mcap.flush()
        except OSError as error:
            raise self._give_up(error) from None
        self._open_bytes = 0

    def close(self) -> None:
        """Write the index and metadata.yaml; does nothing on a closed bag.

        Raises:
            BagError: they could not be written.
        """
        if self._stream is None:
            return
        self.flush()
        try:
            information_yaml = self._add_information()
            self._mcap.finish()
            self._stream.flush()
            write_metadata_yaml(self.folder, information_yaml)
        except OSError as error:
            raise self._give_up(error) from None
        self._stream.close()
        self._stream = None
        self._reserve.unlink()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def _add_information(self) -> str:
        statistics = BagStatistics(self._start_ns or 0, self._end_ns, self._counts)
        text = to_yaml(bag_information(self.file.name, list(self._topics.values()), statistics))
        self._mcap.add_metadata("rosbag2", {"serialized_metadata": text})
        return text

    def _give_up(self, error: OSError) -> BagError:
        """Close the bag with what is safe in it, and say so."""
        if self._stream is not None:
            self._stream.close()
            self._stream = None
        self._reserve.unlink(missing_ok=True)
        try:
            recover_bag(self.folder)
            consequence = "the bag is complete up to there"
        except BagError:
            consequence = (
                f"what was written before is kept, complete it with scripts/record.py --recover {self.folder}"
            )
        return BagError(f"{self.file} cannot be written any more: {error.strerror}; {consequence}")


class _WholeChunks:
    """A file for mcap's writer: everything between two flushes gets there, or nothing of it."""

    def __init__(self, path: Path) -> None:
        self._fd = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o666)
        self._size = 0
        self._pending = bytearray()

    def write(self, data: bytes) -> int:
        self._pending += data
        return len(data)

    def tell(self) -> int:
        return self._size + len(self._pending)

    def flush(self) -> None:
        rest = memoryview(bytes(self._pending))
        try:
            while rest:
                rest = rest[os.write(self._fd, rest) :]
        except OSError:
            os.ftruncate(self._fd, self._size)
            raise
        self._size += len(self._pending)
        self._pending.clear()

    def close(self) -> None:
        os.close(self._fd)
        self._fd = -1
