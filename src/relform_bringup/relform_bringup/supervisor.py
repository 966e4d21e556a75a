"""Start, watch and end the processes of a flight, each in a process group of its own."""

import os
import shutil
import signal
import subprocess
import time
from collections.abc import Iterable, Sequence
from pathlib import Path

from relform_core.c_library import cache_folder
from relform_core.errors import FlightError

STOP_S = 1.2
"""Time in which a process must end after SIGINT; then it is killed."""
POLL_S = 0.01
CRASHES = frozenset({signal.SIGSEGV, signal.SIGBUS, signal.SIGILL, signal.SIGFPE})
"""Signals by which the kernel ends a process that runs into a mistake of compiled code."""


class Child:
    """One process in a session of its own, so that signals of the terminal do not reach it."""

    def __init__(
        self,
        name: str,
        command: Sequence[str],
        log: Path,
        pass_fds: Sequence[int] = (),
        *,
        keeps_log: bool = False,
    ) -> None:
        """Start it.

        Args:
            name: fully qualified name of its node, or what it is called in messages.
            log: file for its output.
            pass_fds: open files that it inherits.
            keeps_log: whether its output is added to what the file holds.
        Raises:
            FlightError: it cannot be started.
        """
        self.name = name
        self.command = command
        self.log = log
        try:
            with log.open("ab" if keeps_log else "wb") as output:
                self._process = subprocess.Popen(
                    command,
                    stdin=subprocess.DEVNULL,
                    stdout=output,
                    stderr=subprocess.STDOUT,
                    start_new_session=True,
                    pass_fds=pass_fds,
                )
        except OSError as error:
            raise FlightError(f"{name}: cannot be started: {error.strerror}: {error.filename}") from None

    @property
    def pid(self) -> int:
        """Its process id."""
        return self._process.pid

    def exit_code(self) -> int | None:
        """Exit code; None while it runs, minus the number of a signal that ended it."""
        return self._process.poll()

    def send(self, signum: int) -> None:
        """Send a signal to the process and to all processes that it has started."""
        if self._process.poll() is None:
            os.killpg(self._process.pid, signum)

    def last_words(self) -> str:
        """The last line that it printed; empty if it printed none."""
        lines = self.log.read_text(encoding="utf-8", errors="replace").split("\n")
        return next((line.strip() for line in reversed(lines) if line.strip()), "")

    def epitaph(self) -> str:
        """How it ended, in one line."""
        code = self.exit_code()
        if code is not None and code < 0:
            killed = f"{self.name} was killed by {signal.Signals(-code).name}"
            if -code not in CRASHES:
                return killed
            return f"{killed}: its compiled code has crashed; if it does so again, delete {cache_folder()}"
        words = self.last_words().removeprefix(f"{self.name}: ")
        return f"{self.name} exited with code {code}" + (f": {words}" if words else "")


class Supervisor:
    """All processes of a flight."""

    def __init__(self, log: Path) -> None:
        """Supervise processes with output files in the folder ``log``."""
        self._log = log
        self._children: list[Child] = []

    def start(
        self,
        name: str,
        command: Sequence[str],
        dies_by: str = "KILL",
        log_name: str | None = None,
        pass_fds: Sequence[int] = (),
    ) -> Child:
        """Start a process.

        Args:
            name: fully qualified name of its node, or what it is called in messages.
            log_name: of the file of its output; None: as its node is called.
            pass_fds: open files that it inherits.
            dies_by: name of the signal that the kernel sends to it when this process dies, even by SIGKILL.
        Raises:
            FlightError: it cannot be started, or this system has no setpriv.
        """
        log = self._log / f"{log_name or name.strip('/').replace('/', '.')}.log"
        child = Child(name, [find_setpriv(), "--pdeathsig", dies_by, "--", *command], log, pass_fds)
        self._children.append(child)
        return child

    def restart(self, child: Child) -> Child:
        """Start a process again that has ended; it inherits no open files.

        Raises:
            FlightError: it cannot be started.
        """
        again = Child(child.name, child.command, child.log, keeps_log=True)
        self._children[self._children.index(child)] = again
        return again

    @property
    def size(self) -> int:
        """Number of processes that were started."""
        return len(self._children)

    @property
    def pids(self) -> dict[str, int]:
        """The process id of each process by its name."""
        return {child.name: child.pid for child in self._children}

    def running(self) -> list[Child]:
        """The processes that run, in the order in which they were started."""
        return [child for child in self._children if child.exit_code() is None]

    def ended(self) -> list[Child]:
        """The processes that have ended, in the order in which they were started."""
        return [child for child in self._children if child.exit_code() is not None]

    def stop(self, first: Child | None = None) -> None:
        """End all processes by SIGINT, and by SIGKILL if one does not end in time.

        Args:
            first: a process that ends before the others get their signal.
        """
        groups = [[child for child in self._children if child is first]] if first is not None else []
        groups.append([child for child in self._children if child is not first])
        for group in groups:
            for child in group:
                child.send(signal.SIGINT)
            if not _wait(group, STOP_S):
                for child in group:
                    child.send(signal.SIGKILL)
                _wait(group, STOP_S)


def find_setpriv() -> str:
    """Path of the program that lets a process end with its parent.

    Raises:
        FlightError: it is not installed.
    """
    if (path := shutil.which("setpriv")) is None:
        raise FlightError("setpriv is not installed: apt install util-linux")
    return path


def _wait(children: Iterable[Child], timeout_s: float) -> bool:
    deadline = time.monotonic() + timeout_s
    while any(child.exit_code() is None for child in children):
        if time.monotonic() > deadline:
            return False
        time.sleep(POLL_S)
    return True
