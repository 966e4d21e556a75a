"""Write files atomically: a reader finds the old content or the new content, never a part of it."""

import json
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, BinaryIO

from relform_core.errors import RelformError


@contextmanager
def written_atomically(path: Path | str) -> Iterator[BinaryIO]:
    """A binary stream; ``path`` gets its content when the block ends without an exception.

    Raises:
        OSError: the file cannot be written.
    """
    draft = _draft_of(Path(path))
    try:
        with draft.open("wb") as stream:
            yield stream
        os.replace(draft, path)
    except BaseException:
        with suppress(OSError):
            draft.unlink()
        raise


def write_atomically(path: Path | str, content: bytes | str) -> None:
    """Write a whole file; text is encoded in UTF-8.

    Raises:
        RelformError: the file cannot be written.
    """
    try:
        with written_atomically(path) as stream:
            stream.write(content.encode() if isinstance(content, str) else content)
    except OSError as error:
        raise RelformError(f"{path}: cannot be written: {error.strerror}") from None


def write_json_atomically(path: Path | str, content: Mapping[str, Any]) -> None:
    """Write a whole file as strict JSON: NaN is none.

    Raises:
        RelformError: the file cannot be written.
        ValueError: a number is not finite.
    """
    write_atomically(path, json.dumps(content, indent=2, allow_nan=False) + "\n")


def link_atomically(path: Path, target: str) -> None:
    """Make ``path`` a symbolic link to ``target``; it replaces a file or link of that name.

    Raises:
        OSError: the link cannot be made.
    """
    draft = _draft_of(path)
    with suppress(FileNotFoundError):
        draft.unlink()  # a process with this id was killed before it was done
    draft.symlink_to(target)
    os.replace(draft, path)


def _draft_of(path: Path) -> Path:
    """A hidden file beside ``path``; two processes that write the same file have two of them."""
    return path.with_name(f".{path.name}-{os.getpid()}")
