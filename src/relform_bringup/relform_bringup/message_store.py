"""Keeps the serialized messages of a flight on disk, so that memory does not grow with its length."""

import os
import struct
import tempfile
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import BinaryIO, Self

BLOCK_BYTES = 256 * 1024
_HEADER = struct.Struct("<II")
"""Index of the topic, and size of the message that follows."""


class MessageStore:
    """Messages in the order in which they were added; iterate to read them back. A context manager.

    The file in ``folder`` has no name, and vanishes with this process. On a full disk, messages stay in
    memory.
    """

    def __init__(self, folder: Path) -> None:
        self._topics: dict[str, int] = {}
        self._file = tempfile.TemporaryFile(dir=folder, buffering=0)  # noqa: SIM115  (__exit__ closes it)
        self._stored = 0
        """Size of the whole blocks in the file."""
        self._block = bytearray()
        self._block_limit = BLOCK_BYTES

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._file.close()

    def add(self, topic: str, data: bytes) -> None:
        """Keep a message."""
        self._block += _HEADER.pack(self._topics.setdefault(topic, len(self._topics)), len(data))
        self._block += data
        if len(self._block) >= self._block_limit:
            self._store_block()

    def __iter__(self) -> Iterator[tuple[str, bytes]]:
        """All messages: topic and data."""
        topics = list(self._topics)
        with open(os.dup(self._file.fileno()), "rb", buffering=BLOCK_BYTES) as stream:
            stream.seek(0)
            while stream.tell() < self._stored:
                yield _read(stream, topics)
        position = 0
        while position < len(self._block):
            index, size = _HEADER.unpack_from(self._block, position)
            begin = position + _HEADER.size
            position = begin + size
            yield topics[index], bytes(self._block[begin:position])

    def _store_block(self) -> None:
        written = 0
        with suppress(OSError):  # the disk is full
            written = os.pwrite(self._file.fileno(), self._block, self._stored)
        if written == len(self._block):
            self._stored += written
            self._block.clear()
            self._block_limit = BLOCK_BYTES
        else:
            self._block_limit = len(self._block) + BLOCK_BYTES


def _read(stream: BinaryIO, topics: list[str]) -> tuple[str, bytes]:
    index, size = _HEADER.unpack(stream.read(_HEADER.size))
    return topics[index], stream.read(size)
