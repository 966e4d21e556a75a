"""The processes of one flight of the campaign, and what is done to them."""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Self

from relform_bringup import flight
from relform_bringup.faults.evidence import Ended
from relform_bringup.faults.plan import CLOCK, CONTROLLER, FLY, RECORDER, VEHICLES, VIEWER, Action, Fault
from relform_bringup.faults.shim import Shim
from relform_bringup.supervisor import Child, Supervisor
from relform_core.installed import executable
from relform_core.names import RECORDER_NODE
from relform_core.run_folder import RunFolder

PROGRAMS = {
    **dict.fromkeys(VEHICLES, flight.QUADROTOR),
    CONTROLLER: flight.CONTROLLER,
    CLOCK: flight.CLOCK,
    RECORDER: flight.RECORDER,
    VIEWER: flight.VISUALIZATION,
    FLY: ("relform_bringup", "fly"),
}
SIGNALS = {
    Action.KILL: signal.SIGKILL,
    Action.STOP: signal.SIGSTOP,
    Action.CONTINUE: signal.SIGCONT,
    Action.INTERRUPT: signal.SIGINT,
}
BUSY = "import os, sys, time\nend = time.monotonic() + float(sys.argv[1])\nwhile time.monotonic() < end: pass"
"""A program that keeps a core busy for a time."""
ORPHAN_S = 4.0
"""Time in which everything must have ended after the last process that was started [s]."""
POLL_S = 0.02


class FlightProcesses:
    """A context manager: at its end nothing runs any more.

    Args:
        folder: of the run; its path is in the command line of every process.
        shim: between the processes and the machine.
        bag: folder of the bag; that of a recorder which is started again gets a number.
    """

    def __init__(self, folder: RunFolder, shim: Shim, bag: Path) -> None:
        self._folder = folder
        self._bag = bag
        self._shim = shim
        self._supervisor = Supervisor(folder.log)
        self._started: list[tuple[str, Child, Path]] = []
        self._killed: set[int] = set()
        """Process ids of those that were killed as a fault."""
        self._core = max(os.sched_getaffinity(0))

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for pid in self.left():
            with suppress(OSError):
                os.kill(pid, signal.SIGKILL)
        self._supervisor.stop()

    def start(self, name: str) -> None:
        """Start a process; a name may be used again."""
        number = sum(1 for each, _, _ in self._started if each == name)
        log_name = f"{name}_{number}" if number else name
        command = [*self._shim.command, executable(*PROGRAMS[name]), *self._arguments(name, number)]
        dies_by = "INT" if name == RECORDER else "KILL"
        child = self._supervisor.start(name, command, dies_by, log_name)
        self._started.append((name, child, self._folder.log / f"{log_name}.log"))

    def do(self, fault: Fault) -> None:
        """Do what a fault asks for, now."""
        match fault.action:
            case Action.START:
                self.start(fault.target)
            case Action.JUMP_CLOCK:
                self._shim.jump(fault.value)
            case Action.SLOW_DISK:
                self._shim.slow_down(fault.value)
            case Action.PIN:
                self._run_on({self._core})
                subprocess.Popen([sys.executable, "-c", BUSY, str(fault.value), str(self._folder.path)])
            case Action.UNPIN:
                self._run_on(os.sched_getaffinity(0))
            case Action.KILL | Action.STOP | Action.CONTINUE | Action.INTERRUPT:
                (*_, child) = (child for name, child, _ in self._started if name == fault.target)
                if fault.action is Action.KILL:
                    self._killed.add(child.pid)
                child.send(SIGNALS[fault.action])

    @property
    def running(self) -> bool:
        """Whether one of the started processes runs."""
        return bool(self._supervisor.running())

    def left(self) -> dict[int, str]:
        """Command lines, by process id, of processes of this flight that run."""
        text, found = str(self._folder.path), {}
        for entry in Path("/proc").iterdir():
            if entry.name.isdecimal() and int(entry.name) != os.getpid():
                with suppress(OSError):
                    command = (entry / "cmdline").read_bytes().replace(b"\0", b" ").decode(errors="replace")
                    if text in command:
                        found[int(entry.name)] = command
        return found

    def orphans(self) -> tuple[str, ...]:
        """Command lines of the processes that are left a while after all others have ended."""
        deadline = time.monotonic() + ORPHAN_S
        while (left := self.left()) and time.monotonic() < deadline:
            time.sleep(POLL_S)
        return tuple(left.values())

    def ends(self) -> tuple[Ended, ...]:
        """How each process ended; to be called after the last one."""
        return tuple(
            Ended(
                name, child.exit_code(), log.read_text("utf-8", errors="replace"), child.pid in self._killed
            )
            for name, child, log in self._started
        )

    def _run_on(self, cores: Iterable[int]) -> None:
        """Let every thread of every process run on some cores only."""
        for pid in self.left():
            with suppress(OSError):
                for task in Path(f"/proc/{pid}/task").iterdir():
                    os.sched_setaffinity(int(task.name), cores)

    def _arguments(self, name: str, number: int) -> list[str]:
        """Of the process that is the so-many-th of its name."""
        if name == FLY:
            out = self._bag.parent.with_name(f"{self._bag.parent.name}{number or ''}")
            return ["--scenario", str(self._folder.config), "--out", str(out)]
        scenario = f"scenario:={json.dumps(str(self._folder.config))}"
        arguments = ["--ros-args", "--disable-external-lib-logs", "-p", scenario]
        if name == VIEWER:
            return arguments
        arguments += ["-p", f"observers:={json.dumps([RECORDER_NODE])}"]
        if name in VEHICLES:
            arguments += ["-r", f"__ns:=/{name}"]
        if name == RECORDER:
            output = f"{self._bag}_{number}" if number else str(self._bag)
            arguments += ["-p", f"output:={json.dumps(output)}"]
        return arguments
