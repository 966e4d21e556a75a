"""Room on the disk for the end of a bag, occupied by a file while the bag is open."""

import os
from pathlib import Path

RESERVE_FILE = ".reserve"
STEP_BYTES = 64 * 1024
"""The reserve grows in steps of this size."""


class Reserve:
    """A file that occupies room; it holds no data."""

    def __init__(self, folder: Path, size: int) -> None:
        """Occupy some bytes; raises OSError if the disk does not have them."""
        self._path = folder / RESERVE_FILE
        self._size = 0
        self._is_held = True
        self.grow_to(size)

    def grow_to(self, size: int) -> None:
        """Occupy at least this many bytes; raises OSError if the disk does not have them."""
        if not self._is_held or size <= self._size:
            return
        size += -size % STEP_BYTES
        descriptor = os.open(self._path, os.O_WRONLY | os.O_CREAT | os.O_CLOEXEC, 0o666)
        try:
            os.posix_fallocate(descriptor, 0, size)
        finally:
            os.close(descriptor)
        self._size = size

    def release(self) -> bool:
        """Give the room back; returns False if that was done before."""
        was_held, self._is_held = self._is_held, False
        self._path.unlink(missing_ok=True)
        return was_held
