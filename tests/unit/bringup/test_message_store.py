"""Messages of a flight are kept on disk and come back in their order."""

import resource
import tracemalloc
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from relform_bringup.message_store import BLOCK_BYTES, MessageStore


def messages(number: int) -> list[tuple[str, bytes]]:
    generator = np.random.default_rng(3)
    return [
        (f"/topic_{generator.integers(5)}", generator.bytes(int(generator.integers(0, 9000))))
        for _ in range(number)
    ]


@pytest.mark.parametrize("number", [0, 1, 500])
def test_messages_come_back_in_their_order(tmp_path: Path, number: int) -> None:
    added = messages(number)
    with MessageStore(tmp_path) as store:
        for topic, data in added:
            store.add(topic, data)
        assert list(store) == added
        assert list(store) == added  # a second time
        assert list(tmp_path.iterdir()) == []  # the file has no name


def test_memory_is_flat(tmp_path: Path) -> None:
    with MessageStore(tmp_path) as store:
        tracemalloc.start()
        try:
            for _ in range(50_000):
                store.add("/topic", bytes(1000))
            _, peak = tracemalloc.get_traced_memory()
        finally:
            tracemalloc.stop()
        assert peak < 4 * BLOCK_BYTES
        assert sum(len(data) for _, data in store) == 50_000_000


@contextmanager
def file_size_limit(size: int) -> Iterator[None]:
    """A disk that is full, for files of this process."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


def test_full_disk_loses_nothing(tmp_path: Path) -> None:
    added = messages(500)
    with MessageStore(tmp_path) as store:
        with file_size_limit(3 * BLOCK_BYTES + 100):  # a block is written in part, the next ones not at all
            for topic, data in added:
                store.add(topic, data)
        assert list(store) == added
        for topic, data in added:
            store.add(topic, data)
        assert list(store) == added + added
