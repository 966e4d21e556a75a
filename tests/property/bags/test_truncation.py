"""A bag cut off at any byte: every finished chunk is read, and recovered for every reader."""

import contextlib
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader
from rosbags.rosbag2 import Reader

from relform_bags.reader import BagMessage, read_bag
from relform_bags.recover import recover_bag
from relform_core.errors import BagError
from support.bags import write_bag

NUMBER = 12


@dataclass(frozen=True)
class Complete:
    """A complete file."""

    content: bytes = field(repr=False)
    chunks: list[tuple[int, int]]
    """End of each chunk, and number of messages up to there."""


@pytest.fixture(scope="module")
def complete(tmp_path_factory: pytest.TempPathFactory) -> Complete:
    folder = tmp_path_factory.mktemp("complete") / "bag"
    write_bag(folder, NUMBER, flush_every=2)
    path = folder / "bag_0.mcap"
    content = path.read_bytes()
    ends = []
    with path.open("rb") as file:
        reader = make_reader(file)
        summary = reader.get_summary()
        assert summary is not None
        for chunk in sorted(summary.chunk_indexes, key=lambda each: each.chunk_start_offset):
            ends.append(chunk.chunk_start_offset + chunk.chunk_length)
    total = len(messages(path))
    assert len(ends) > NUMBER // 2
    counts = []
    for end in ends:
        path.write_bytes(content[:end])
        counts.append(len(messages(path)))
    assert counts[-1] == total == NUMBER * 5
    assert sorted(set(counts)) == counts  # each chunk adds some
    return Complete(content, list(zip(ends, counts, strict=True)))


def messages(path: Path) -> list[Any]:
    return [entry for entry in read_bag(path) if isinstance(entry, BagMessage)]


@settings(max_examples=50)
@given(cut=st.floats(0.0, 1.0))
def test_every_finished_chunk_is_kept(
    complete: Complete, tmp_path_factory: pytest.TempPathFactory, cut: float
) -> None:
    size = round(cut * len(complete.content))
    folder = tmp_path_factory.mktemp("cut")
    path = folder / "bag_0.mcap"
    path.write_bytes(complete.content[:size])
    expected = max((count for end, count in complete.chunks if end <= size), default=0)
    try:
        found = messages(path)
    except BagError:
        assert size < 8  # not even the magic bytes
        return
    assert len(found) == expected
    try:
        assert recover_bag(folder) is True  # at least metadata.yaml was missing
    except BagError:
        assert expected == 0
        return
    kept = max((end for end, _ in complete.chunks if end <= size), default=0)
    assert path.read_bytes()[:kept] == complete.content[:kept]  # in place
    assert messages(path) == found
    with Reader(folder) as reader:
        assert reader.message_count == expected
        assert [bytes(data) for _, _, data in reader.messages()] == [entry.data for entry in by_time(found)]
    with path.open("rb") as file:
        indexed = make_reader(file, validate_crcs=True)
        assert sum(1 for _ in indexed.iter_messages()) == expected
        assert {a.name for a in indexed.iter_attachments()} <= {"config.yaml", "versions.json"}
    assert recover_bag(folder) is False


def by_time(found: list[Any]) -> list[Any]:
    return sorted(found, key=lambda entry: entry.log_time_ns)


@pytest.mark.parametrize("length", [2**63, 2**64 - 1])
def test_damaged_length_of_a_chunk_ends_the_reading(
    complete: Complete, tmp_path_factory: pytest.TempPathFactory, length: int
) -> None:
    folder = tmp_path_factory.mktemp("damaged")
    path = folder / "bag_0.mcap"
    head, name, rest = complete.content.partition(b"\x04\x00\x00\x00zstd")
    path.write_bytes(head + name + length.to_bytes(8, "little") + rest[8:])
    assert messages(path) == []
    with contextlib.suppress(BagError):
        recover_bag(folder)


@settings(max_examples=50)
@given(position=st.floats(0.0, 1.0), garbage=st.binary(min_size=1, max_size=40))
def test_damage_raises_only_bag_errors(
    complete: Complete, tmp_path_factory: pytest.TempPathFactory, position: float, garbage: bytes
) -> None:
    folder = tmp_path_factory.mktemp("damaged")
    path = folder / "bag_0.mcap"
    start = round(position * (len(complete.content) - len(garbage)))
    path.write_bytes(complete.content[:start] + garbage + complete.content[start + len(garbage) :])
    for action in (messages, lambda _: recover_bag(folder)):
        with contextlib.suppress(BagError):  # any other error fails the test
            action(path)
