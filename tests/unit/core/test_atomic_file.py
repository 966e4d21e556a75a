"""Files are written atomically, and a failed write leaves the old content and no draft."""

import re
from pathlib import Path

import pytest

from relform_core.atomic_file import link_atomically, write_atomically, written_atomically
from relform_core.errors import RelformError


@pytest.mark.parametrize("content", ["täxt\n", b"\x00\xff"])
def test_write_replaces_the_file(tmp_path: Path, content: bytes | str) -> None:
    path = tmp_path / "file"
    path.write_text("old")
    write_atomically(path, content)
    assert path.read_bytes() == (content if isinstance(content, bytes) else content.encode())
    assert list(tmp_path.iterdir()) == [path]


def test_reader_finds_the_old_content_until_the_block_ends(tmp_path: Path) -> None:
    path = tmp_path / "file"
    path.write_text("old")
    with written_atomically(path) as stream:
        stream.write(b"new")
        stream.flush()
        assert path.read_text() == "old"
    assert path.read_text() == "new"


def test_interrupted_write_keeps_the_old_content_and_no_draft(tmp_path: Path) -> None:
    path = tmp_path / "file"
    path.write_text("old")
    with pytest.raises(KeyboardInterrupt), written_atomically(path):
        raise KeyboardInterrupt
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_unwritable_file_is_one_line(tmp_path: Path) -> None:
    path = tmp_path / "missing/file"
    message = f"^{re.escape(str(path))}: cannot be written: No such file or directory$"
    with pytest.raises(RelformError, match=message):
        write_atomically(path, "text")


def test_link_replaces_a_link(tmp_path: Path) -> None:
    path = tmp_path / "latest"
    for target in ("one", "two"):
        link_atomically(path, target)
        assert str(path.readlink()) == target
    assert list(tmp_path.iterdir()) == [path]
