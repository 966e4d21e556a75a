"""A full disk, and the report of a recorder on it."""

import contextlib
import os
import re
import subprocess
from collections.abc import Iterator
from decimal import Decimal
from pathlib import Path

import pytest


@contextlib.contextmanager
def tiny_disk(folder: Path, size: str = "1m") -> Iterator[Path]:
    """A new folder on a disk of its own; skip the test if mounting is not allowed."""
    folder.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", str(folder)]
    if os.geteuid() != 0 or subprocess.run(mount, capture_output=True).returncode != 0:
        pytest.skip("only root can mount a tiny disk")
    try:
        yield folder
    finally:
        subprocess.run(["umount", str(folder)], check=True)


def complete_before_ns(errors: str) -> int:
    """The log time up to which a recorder reports that its bag holds every message."""
    match = re.search(r"the bag holds every message before ([\d.]+) s", errors)
    assert match, errors
    return int(Decimal(match[1]) * 1_000_000_000)
