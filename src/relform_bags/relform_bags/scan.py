"""Scan an MCAP file record by record, and write its index if it has none."""

import os
from collections import Counter
from collections.abc import Iterable
from pathlib import Path
from typing import BinaryIO

from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    Attachment,
    AttachmentIndex,
    Channel,
    Chunk,
    ChunkIndex,
    DataEnd,
    Footer,
    McapRecord,
    Message,
    MessageIndex,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)
from ruamel.yaml import YAML

from relform_bags.metadata import NO_TIME_NS, FileContent, RecordedTopic, bag_information
from relform_bags.records import (
    MAGIC,
    DataRecord,
    RawRecord,
    chunk_records,
    data_records,
    raw_records,
    read_errors,
)
from relform_core.errors import BagError


class FileScan:
    """Content of an MCAP file up to its last good record, as an index states it."""

    def __init__(self, file: BinaryIO, path: Path) -> None:
        """Read a file.

        Args:
            file: is at any position, and stays open.
            path: for errors.
        Raises:
            BagError: the file is not MCAP, or is compressed in a way that cannot be read.
        """
        self.was_complete = False
        """Whether the file has an index."""
        self._name = path.name
        self._end = len(MAGIC)
        """Offset of the end of the last good record."""
        self._schemas: dict[int, Schema] = {}
        self._channels: dict[int, Channel] = {}
        self._chunks: list[ChunkIndex] = []
        self._last_indexes: dict[int, MessageIndex] = {}
        """Index of the messages in the last chunk, by channel."""
        self._attachments: list[AttachmentIndex] = []
        self._metadata: list[MetadataIndex] = []
        self._counts: Counter[int] = Counter()
        """Number of messages by channel."""
        self._start_ns = NO_TIME_NS
        self._end_ns = 0
        with read_errors(path):
            for record in raw_records(file, path):
                if record.opcode == Opcode.DATA_END:
                    file.seek(-len(MAGIC), os.SEEK_END)
                    self.was_complete = file.read() == MAGIC
                    break
                self._take(record)
                self._end = record.offset + record.length

    @property
    def empty(self) -> bool:
        """Whether the file has no good record."""
        return self._end == len(MAGIC)

    @property
    def topics(self) -> list[RecordedTopic]:
        """The topics that the file declares."""
        yaml = YAML(typ="safe", pure=True)
        return [
            RecordedTopic(
                name=channel.topic,
                type_name=schema.name if (schema := self._schemas.get(channel.schema_id)) else "",
                type_hash=channel.metadata.get("topic_type_hash", ""),
                offered_qos=yaml.load(channel.metadata.get("offered_qos_profiles", "")) or [],
            )
            for channel in self._channels.values()
        ]

    @property
    def content(self) -> FileContent:
        """The entry of the file in metadata.yaml."""
        counts = {channel.topic: self._counts[channel.id] for channel in self._channels.values()}
        if not self._counts:
            return FileContent(self._name, counts)
        return FileContent(self._name, counts, self._start_ns, self._end_ns)

    def write_index(self, file: BinaryIO) -> None:
        """Replace everything behind the last good record by the end of a closed file."""
        builder = RecordBuilder()
        if self._chunks and len(self._chunks[-1].message_index_offsets) < len(self._last_indexes):
            self._write_last_indexes(builder)
        DataEnd(data_section_crc=0).write(builder)
        start = self._end + builder.count
        groups: dict[Opcode, Iterable[McapRecord]] = {
            Opcode.SCHEMA: self._schemas.values(),
            Opcode.CHANNEL: self._channels.values(),
            Opcode.STATISTICS: [self._statistics()],
            Opcode.CHUNK_INDEX: self._chunks,
            Opcode.ATTACHMENT_INDEX: self._attachments,
            Opcode.METADATA_INDEX: self._metadata,
        }
        offsets = []
        for opcode, records in groups.items():
            group_start = self._end + builder.count
            for record in records:
                record.write(builder)
            if group_length := self._end + builder.count - group_start:
                offsets.append(SummaryOffset(opcode, group_start, group_length))
        offsets_start = self._end + builder.count
        for offset in offsets:
            offset.write(builder)
        Footer(summary_start=start, summary_offset_start=offsets_start, summary_crc=0).write(builder)
        file.truncate(self._end)
        file.seek(self._end)
        file.write(builder.end() + MAGIC)
        file.flush()

    def _write_last_indexes(self, builder: RecordBuilder) -> None:
        """Write the message indexes behind the last chunk again, where the file was cut within them."""
        chunk = self._chunks[-1]
        self._end = chunk.chunk_start_offset + chunk.chunk_length
        for channel_id, index in self._last_indexes.items():
            chunk.message_index_offsets[channel_id] = self._end + builder.count
            index.write(builder)
        chunk.message_index_length = builder.count

    def _statistics(self) -> Statistics:
        return Statistics(
            attachment_count=len(self._attachments),
            channel_count=len(self._channels),
            channel_message_counts=dict(self._counts),
            chunk_count=len(self._chunks),
            message_count=self._counts.total(),
            message_start_time=self._start_ns if self._counts else 0,
            message_end_time=self._end_ns,
            metadata_count=len(self._metadata),
            schema_count=len(self._schemas),
        )

    def _take(self, record: RawRecord) -> None:
        match record.opcode:
            case Opcode.CHUNK:
                self._take_chunk(record)
            case Opcode.MESSAGE_INDEX:
                chunk = self._chunks[-1]
                chunk.message_index_offsets[MessageIndex.read(record.stream).channel_id] = record.offset
                chunk.message_index_length += record.length
            case Opcode.ATTACHMENT:
                attachment = Attachment.read(record.stream)
                self._attachments.append(
                    AttachmentIndex(
                        offset=record.offset,
                        length=record.length,
                        log_time=attachment.log_time,
                        create_time=attachment.create_time,
                        data_size=len(attachment.data),
                        name=attachment.name,
                        media_type=attachment.media_type,
                    )
                )
            case Opcode.METADATA:
                name = Metadata.read(record.stream).name
                self._metadata.append(MetadataIndex(record.offset, record.length, name))
            case _:
                for entry in data_records(record):
                    self._take_entry(entry)

    def _take_entry(self, entry: DataRecord) -> None:
        match entry:
            case Schema():
                self._schemas[entry.id] = entry
            case Channel():
                self._channels[entry.id] = entry
            case Message():
                self._counts[entry.channel_id] += 1
                self._start_ns = min(self._start_ns, entry.log_time)
                self._end_ns = max(self._end_ns, entry.log_time)

    def _take_chunk(self, record: RawRecord) -> None:
        chunk = Chunk.read(record.stream)
        self._last_indexes = {}
        for position, entry in chunk_records(chunk, record.path):
            self._take_entry(entry)
            if isinstance(entry, Message):
                index = self._last_indexes.setdefault(entry.channel_id, MessageIndex(entry.channel_id, []))
                index.records.append((entry.log_time, position))
        self._chunks.append(
            ChunkIndex(
                chunk_length=record.length,
                chunk_start_offset=record.offset,
                compression=chunk.compression,
                compressed_size=len(chunk.data),
                message_end_time=chunk.message_end_time,
                message_index_length=0,
                message_index_offsets={},
                message_start_time=chunk.message_start_time,
                uncompressed_size=chunk.uncompressed_size,
            )
        )


def information_of(scans: Iterable[FileScan]) -> dict[str, object]:
    """Content of metadata.yaml for a bag of these files."""
    scans = list(scans)
    topics = {topic.name: topic for scan in scans for topic in scan.topics}
    return bag_information(list(topics.values()), [scan.content for scan in scans])


def scan_bag(files: Iterable[Path]) -> list[FileScan]:
    """Read all files of a bag.

    Raises:
        BagError: a file cannot be read, or is not MCAP.
    """
    scans = []
    for path in files:
        try:
            with path.open("rb") as file:
                scans.append(FileScan(file, path))
        except OSError as error:
            raise BagError(f"{path}: cannot be read: {error.strerror}") from None
    return scans
