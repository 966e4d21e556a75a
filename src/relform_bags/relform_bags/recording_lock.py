"""Whether a bag is being recorded: its writer locks the open file, and the lock ends with its process."""

import fcntl
import os
from contextlib import suppress
from pathlib import Path

from relform_bags.reader import bag_files


def hold(descriptor: int) -> None:
    """Mark an open file as being recorded until it is closed; no effect on file systems without locks."""
    with suppress(OSError):
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)


def is_being_recorded(path: Path) -> bool:
    """Whether a recorder on this machine has a file of this bag open.

    Args:
        path: as of ``bag_files``.
    Raises:
        BagError: there is no bag.
    """
    return any(map(_is_held, bag_files(path)))


def _is_held(file: Path) -> bool:
    try:
        descriptor = os.open(file, os.O_RDONLY | os.O_CLOEXEC)
    except OSError:
        return False
    try:
        fcntl.flock(descriptor, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except OSError:
        return False
    else:
        return False
    finally:
        os.close(descriptor)
