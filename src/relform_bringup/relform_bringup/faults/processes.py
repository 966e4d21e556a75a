"""The processes of one flight of the campaign, and what is done to them."""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass
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
from relform_core.run_folder import BAG, RunFolder

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


@dataclass
class _Started:
    name: str
    log_name: str
    """Different for each process of a name."""
    child: Child
    was_killed: bool = False
    """As a fault."""
    was_dismissed: bool = False
    """It was started so late that the flight was over."""

    @property
    def is_additional(self) -> bool:
        """Whether it was started beside, or instead of, a node that a flight consists of."""
        is_second = self.log_name != self.name and self.name not in (FLY, CLOCK)
        return is_second or self.name == VIEWER


class FlightProcesses:
    """A context manager: at its end nothing runs any more.

    Args:
        folder: of the run; its path is in the command line of every process.
        shim: between the processes and the machine.
        bags: where recorders make the folders of their bags.
    """

    def __init__(self, folder: RunFolder, shim: Shim, bags: Path) -> None:
        self._folder = folder
        self._bags = bags
        self._shim = shim
        self._supervisor = Supervisor(folder.log)
        self._started: list[_Started] = []
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
        number = sum(1 for each in self._started if each.name == name)
        log_name = f"{name}_{number}" if number else name
        command = [*self._shim.command, executable(*PROGRAMS[name]), *self._arguments(name, number)]
        dies_by = "INT" if name == RECORDER else "KILL"
        child = self._supervisor.start(name, command, dies_by, log_name)
        self._started.append(_Started(name, log_name, child))

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
                self._send(fault.target, SIGNALS[fault.action])

    @property
    def running(self) -> bool:
        """Whether one of the started processes runs."""
        return bool(self._supervisor.running())

    @property
    def flying(self) -> bool:
        """Whether one of them runs that is part of the flight from its start."""
        return any(each.child.exit_code() is None for each in self._started if not each.is_additional)

    def dismiss(self) -> None:
        """Interrupt the additional processes that are left: a node without a flight waits for one."""
        for each in self._started:
            if each.is_additional and each.child.exit_code() is None:
                each.was_dismissed = True
                each.child.send(signal.SIGINT)

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
                each.log_name,
                each.child.exit_code(),
                (self._folder.log / f"{each.log_name}.log").read_text("utf-8", errors="replace"),
                each.was_killed,
                each.was_dismissed,
            )
            for each in self._started
        )

    @property
    def bags(self) -> tuple[Path, ...]:
        """Folders of the bags, in the order in which they were begun."""
        numbers = range(sum(1 for each in self._started if each.name in (RECORDER, FLY)))
        by_fly = any(each.name == FLY for each in self._started)
        return tuple(self._out(number) / BAG if by_fly else self._recorded(number) for number in numbers)

    def _send(self, target: str, signum: int) -> None:
        """Send a signal to the newest process of a name, or to a node of ``fly`` (``fly:controller``)."""
        owner, _, node = target.rpartition(":")
        if owner:
            program = "/".join(("lib", *PROGRAMS[node]))
            namespace = f"__ns:=/{node}" if node in VEHICLES else ""
            (pid,) = (pid for pid, line in self.left().items() if f"{program} " in line and namespace in line)
            os.kill(pid, signum)
            return
        (*_, process) = (each for each in self._started if each.name == target)
        process.was_killed |= signum == signal.SIGKILL
        process.child.send(signum)

    def _run_on(self, cores: Iterable[int]) -> None:
        """Let every thread of every process run on some cores only."""
        for pid in self.left():
            with suppress(OSError):
                for task in Path(f"/proc/{pid}/task").iterdir():
                    os.sched_setaffinity(int(task.name), cores)

    def _arguments(self, name: str, number: int) -> list[str]:
        """Of the process that is the so-many-th of its name."""
        if name == FLY:
            return ["--scenario", str(self._folder.config), "--out", str(self._out(number))]
        scenario = f"scenario:={json.dumps(str(self._folder.config))}"
        arguments = ["--ros-args", "--disable-external-lib-logs", "-p", scenario]
        if name == VIEWER:
            return arguments
        arguments += ["-p", f"observers:={json.dumps([RECORDER_NODE])}"]
        if name in VEHICLES:
            arguments += ["-r", f"__ns:=/{name}"]
        if name == RECORDER:
            arguments += ["-p", f"output:={json.dumps(str(self._recorded(number)))}"]
        return arguments

    def _recorded(self, number: int) -> Path:
        """Folder of the bag of the so-many-th recorder."""
        return self._bags / (f"{BAG}_{number}" if number else BAG)

    def _out(self, number: int) -> Path:
        """Run folder of the so-many-th ``fly``."""
        return self._folder.path / (f"flown_{number}" if number else "flown")
