"""Wait for processes, find those that are left over, and clean their output."""

import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path


def wait_until(condition: Callable[[], bool], timeout_s: float = 30.0) -> None:
    """Wait for a condition; fail if it does not become true in time."""
    deadline = time.monotonic() + timeout_s
    while not condition():
        assert time.monotonic() < deadline, "the condition did not become true in time"
        time.sleep(0.02)


def processes_naming(text: str) -> dict[int, str]:
    """Command lines, by process id, of the processes with a text in their arguments."""
    found = {}
    for entry in Path("/proc").iterdir():
        if entry.name.isdecimal():
            with suppress(OSError):
                command = (entry / "cmdline").read_bytes().replace(b"\0", b" ").decode(errors="replace")
                if text in command:
                    found[int(entry.name)] = command
    return found


def without_middleware(output: str) -> str:
    """The output of a process without the warnings of its middleware, which occur on a busy machine."""
    return "".join(line for line in output.splitlines(keepends=True) if "RTPS" not in line)
