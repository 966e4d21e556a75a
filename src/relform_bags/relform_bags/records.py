"""Read an MCAP file from its beginning, record by record, up to its end or to where it is damaged.

The readers of the mcap library need the index at the end of the file, which only a closed file has.
"""

import os
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import BinaryIO

from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError, UnsupportedCompressionError
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, Message, Schema
from mcap.stream_reader import CRCValidationError, get_chunk_data_stream
from zstandard import ZstdError

from relform_core.errors import BagError

MAGIC = b"\x89MCAP0\r\n"
RECORD_HEADER = struct.Struct("<BQ")
COMPRESSIONS = ("", "lz4", "zstd")
"""Of chunks, as the MCAP format names them."""
ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"
"""No serialized message begins with it."""
MESSAGES_COMPRESSED = (
    "messages compressed one by one (rosbag2 compression mode message) cannot be read; "
    "convert the bag with ros2 bag convert"
)
TORN = (
    McapError,
    CRCValidationError,
    ZstdError,
    struct.error,
    LookupError,
    MemoryError,
    OverflowError,
    RuntimeError,
    ValueError,
)
"""What reading a damaged record raises, here, in the mcap library or in lz4 (RuntimeError)."""

DataRecord = Schema | Channel | Message


@contextmanager
def read_errors(path: Path) -> Iterator[None]:
    """Run a block that reads a file; damage in the file ends it without an error.

    Raises:
        BagError: the file cannot be read.
    """
    try:
        yield
    except UnsupportedCompressionError as error:
        raise BagError(f"{path}: cannot be read: {error}") from None
    except OSError as error:
        raise BagError(f"{path}: cannot be read: {error.strerror}") from None
    except TORN:
        return


@dataclass(frozen=True)
class RawRecord:
    """A record and its place in the file."""

    path: Path
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
    """Every record that the file has as a whole, in file order.

    Raises:
        BagError: the file does not begin as an MCAP file.
    """
    size = file.seek(0, os.SEEK_END)
    file.seek(0)
    if file.read(len(MAGIC)) != MAGIC:
        raise BagError(f"{path}: not an MCAP file{'' if size else ': it is empty'}")
    offset = len(MAGIC)
    while offset + RECORD_HEADER.size <= size:
        opcode, length = RECORD_HEADER.unpack(file.read(RECORD_HEADER.size))
        if offset + RECORD_HEADER.size + length > size:
            return
        record = RawRecord(path, opcode, offset, file.read(length))
        yield record
        offset += record.length


def data_records(record: RawRecord) -> Iterator[DataRecord]:
    """Schemas, channels and messages of a chunk; a file without chunks has them as records of their own.

    Raises:
        BagError: see ``chunk_records``.
    """
    if record.opcode == Opcode.CHUNK:
        for _, entry in chunk_records(Chunk.read(record.stream), record.path):
            yield entry
        return
    single = _data_record(record.opcode, record.stream, len(record.content), record.path)
    if single is not None:
        yield single


def chunk_records(chunk: Chunk, path: Path) -> Iterator[tuple[int, DataRecord]]:
    """Schemas, channels and messages of a chunk, each with its position in the uncompressed chunk.

    Raises one of ``TORN`` before the first record if the chunk is damaged.

    Raises:
        BagError: the chunk is compressed in an unknown way, or its messages are compressed one by one.
    """
    if chunk.compression not in COMPRESSIONS:
        raise BagError(f"{path}: cannot be read: unknown compression '{chunk.compression}'")
    stream, size = get_chunk_data_stream(chunk, validate_crc=True)
    while (position := stream.count) < size:
        opcode, length = stream.read1(), stream.read8()
        if (entry := _data_record(opcode, stream, length, path)) is not None:
            yield position, entry


def _data_record(opcode: int, stream: ReadDataStream, length: int, path: Path) -> DataRecord | None:
    """The next record of a stream; None, and the stream behind it, if it is of another kind."""
    entry: DataRecord | None = None
    match opcode:
        case Opcode.SCHEMA:
            entry = Schema.read(stream)
        case Opcode.CHANNEL:
            entry = Channel.read(stream)
        case Opcode.MESSAGE:
            message = Message.read(stream, length)
            if message.data.startswith(ZSTD_MAGIC):
                raise BagError(f"{path}: {MESSAGES_COMPRESSED}")
            entry = message
        case _:
            stream.read(length)
    return entry
