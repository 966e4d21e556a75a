"""Wait for processes, and find those that are left over."""

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


LISTENS = "0A"
"""State of a TCP socket that listens, as in /proc/net/tcp."""


def listening_addresses(process_id: int) -> set[str]:
    """IP addresses, as in /proc/net, on which a process can be reached by TCP or UDP."""
    process = Path("/proc", str(process_id))
    files = set()
    for entry in (process / "fd").iterdir():
        with suppress(OSError):
            files.add(str(entry.readlink()))
    found = set()
    for protocol in ("tcp", "tcp6", "udp", "udp6"):
        table = process / "net" / protocol
        for line in table.read_text().splitlines()[1:] if table.exists() else ():
            _, local, _, state, *_, inode = line.split()[:10]
            if f"socket:[{inode}]" in files and (protocol.startswith("udp") or state == LISTENS):
                found.add(local.partition(":")[0])
    return found
