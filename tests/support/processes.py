"""Waiting for processes, and finding those that are left over."""

import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path


def wait_until(condition: Callable[[], bool], timeout_s: float = 30.0) -> None:
    """Wait for a condition; an assertion fails when it does not come true in time."""
    deadline = time.monotonic() + timeout_s
    while not condition():
        assert time.monotonic() < deadline, "waited in vain"
        time.sleep(0.02)


def processes_naming(text: str) -> dict[int, str]:
    """Command lines by process id of the processes in whose arguments a text occurs."""
    found = {}
    for entry in Path("/proc").iterdir():
        if entry.name.isdecimal():
            with suppress(OSError):
                command = (entry / "cmdline").read_bytes().replace(b"\0", b" ").decode(errors="replace")
                if text in command:
                    found[int(entry.name)] = command
    return found


def without_middleware(errors: str) -> str:
    """What a process itself wrote to stderr, without the complaints of its middleware."""
    return "".join(line for line in errors.splitlines(keepends=True) if "RTPS" not in line)
