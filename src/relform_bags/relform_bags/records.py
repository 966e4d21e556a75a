"""Read an MCAP file from its beginning, record by record, as far as it goes: it may end anywhere.

The readers of the mcap library want the index at the end, which is there only if the writer could finish.
"""

import os
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import BinaryIO

from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, McapRecord, Message, Schema
from mcap.stream_reader import CRCValidationError, get_chunk_data_stream
from zstandard import ZstdError

from relform_core.errors import BagError

MAGIC = b"\x89MCAP0\r\n"
RECORD_HEADER = struct.Struct("<BQ")
TORN = (McapError, CRCValidationError, ZstdError, struct.error, ValueError)
"""What the mcap library raises on a record whose content is damaged."""


@dataclass(frozen=True)
class RawRecord:
    """A record and where it stands in the file."""

    opcode: int
    offset: int
    content: bytes

    @property
    def length(self) -> int:
        """Bytes in the file."""
        return RECORD_HEADER.size + len(self.content)

    @property
    def stream(self) -> ReadDataStream:
        """The content, as the record types of the mcap library read it."""
        return ReadDataStream(BytesIO(self.content))


def raw_records(file: BinaryIO, path: Path) -> Iterator[RawRecord]:
    """Every record that is in the file as a whole, in file order.

    Raises:
        BagError: the file does not begin as an MCAP file.
    """
    size = file.seek(0, os.SEEK_END)
    file.seek(0)
    if file.read(len(MAGIC)) != MAGIC:
        raise BagError(f"{path}: not an MCAP file")
    offset = len(MAGIC)
    while offset + RECORD_HEADER.size <= size:
        opcode, length = RECORD_HEADER.unpack(file.read(RECORD_HEADER.size))
        if offset + RECORD_HEADER.size + length > size:
            return
        record = RawRecord(opcode, offset, file.read(length))
        yield record
        offset += record.length


def chunk_records(chunk: Chunk) -> Iterator[tuple[int, McapRecord]]:
    """Schemas, channels and messages of a chunk, each with its position in the uncompressed chunk.

    Raises one of ``TORN`` before the first record if the chunk is damaged.
    """
    stream, size = get_chunk_data_stream(chunk, validate_crc=True)
    while (position := stream.count) < size:
        opcode, length = stream.read1(), stream.read8()
        match opcode:
            case Opcode.SCHEMA:
                yield position, Schema.read(stream)
            case Opcode.CHANNEL:
                yield position, Channel.read(stream)
            case Opcode.MESSAGE:
                yield position, Message.read(stream, length)
            case _:
                stream.read(length)
