"""Worker processes: a process that dies loses one call."""

import math
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from relform_analysis.sweep.workers import LocalProcesses
from relform_core.errors import RelformError


@pytest.fixture
def executor() -> Iterator[LocalProcesses]:
    executor = LocalProcesses(2)
    yield executor
    executor.shutdown(cancel_futures=True)


def is_gone(pid: int, within: float = 20.0) -> bool:
    deadline = time.monotonic() + within
    while time.monotonic() < deadline:
        try:
            if Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] == "Z":
                return True
        except (FileNotFoundError, ProcessLookupError):
            return True
        time.sleep(0.02)
    return False


def test_calls_are_answered_by_other_processes(executor: LocalProcesses) -> None:
    assert list(executor.map(math.hypot, [3.0, 5.0, 8.0], [4.0, 12.0, 15.0])) == [5.0, 13.0, 17.0]
    assert os.getpid() not in {executor.submit(os.getpid).result() for _ in range(4)}


def test_a_process_that_dies_loses_only_its_own_call(executor: LocalProcesses) -> None:
    killed = executor.submit(signal.raise_signal, signal.SIGKILL)
    left = executor.submit(os._exit, 3)
    after = [executor.submit(math.sqrt, 16.0) for _ in range(4)]
    with pytest.raises(RelformError, match=r"was killed by SIGKILL, perhaps because memory ran out"):
        killed.result()
    with pytest.raises(RelformError, match=r"ended with exit code 3"):
        left.result()
    assert [future.result() for future in after] == [4.0] * 4


def test_workers_ignore_an_interrupt_from_the_keyboard(executor: LocalProcesses) -> None:
    assert executor.submit(signal.raise_signal, signal.SIGINT).result() is None


def test_shutdown_ends_running_calls() -> None:
    executor = LocalProcesses(1)
    pid = executor.submit(os.getpid).result()
    running, waiting = executor.submit(time.sleep, 600.0), executor.submit(time.sleep, 600.0)
    while not running.running():
        time.sleep(0.01)
    begin = time.monotonic()
    executor.shutdown(cancel_futures=True)
    assert is_gone(pid)
    with pytest.raises(RelformError, match="SIGKILL"):
        running.result(timeout=20.0)
    assert waiting.cancelled()
    assert time.monotonic() - begin < 60.0


def test_workers_end_with_their_parent() -> None:
    program = (
        "import os, time\n"
        "from relform_analysis.sweep.workers import LocalProcesses\n"
        "if __name__ == '__main__':\n"
        "    print(LocalProcesses(1).submit(os.getpid).result(), flush=True)\n"
        "    time.sleep(600.0)\n"
    )
    with subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, text=True) as parent:
        assert parent.stdout is not None
        worker = int(parent.stdout.readline())
        parent.kill()
    assert is_gone(worker)
