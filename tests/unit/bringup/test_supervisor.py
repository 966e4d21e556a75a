"""Small real processes are started, lost and ended."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from relform_bringup.supervisor import Child, Supervisor
from relform_core.c_library import cache_folder
from relform_core.errors import FlightError
from relform_core.installed import executable
from support.processes import wait_until

POLITE = "trap 'echo bye; exit 130' INT; echo ready; while :; do sleep 0.01; done"
STUBBORN = "trap '' INT; echo ready; while :; do sleep 0.01; done"


def ready(child: Child) -> bool:
    return child.last_words() == "ready"


@pytest.fixture
def supervisor(tmp_path: Path) -> Supervisor:
    return Supervisor(tmp_path)


def shell(supervisor: Supervisor, name: str, script: str) -> Child:
    return supervisor.start(name, ["sh", "-c", script])


def test_output_goes_to_a_file_per_node(supervisor: Supervisor, tmp_path: Path) -> None:
    shell(supervisor, "/follower_1/quadrotor", "echo out; echo err >&2")
    wait_until(lambda: not supervisor.running())
    assert (tmp_path / "follower_1.quadrotor.log").read_text() == "out\nerr\n"


@pytest.mark.parametrize(
    ("script", "epitaph"),
    [
        ("kill -9 $$", "/a/b was killed by SIGKILL"),
        (
            "kill -SEGV $$",
            "/a/b was killed by SIGSEGV: its compiled code has crashed; if it does so again, delete "
            f"{cache_folder()}",
        ),
        ("exit 4", "/a/b exited with code 4"),
        ("echo one; echo /a/b: two >&2; echo; exit 1", "/a/b exited with code 1: two"),
    ],
)
def test_epitaph(script: str, epitaph: str, supervisor: Supervisor) -> None:
    child = shell(supervisor, "/a/b", script)
    wait_until(lambda: supervisor.ended() == [child])
    assert child.epitaph() == epitaph


def test_lost_process_is_known_while_the_others_run(supervisor: Supervisor) -> None:
    stays, goes = shell(supervisor, "/stays", POLITE), shell(supervisor, "/goes", "exit 1")
    wait_until(lambda: bool(supervisor.ended()) and ready(stays))
    assert supervisor.ended() == [goes]
    assert supervisor.running() == [stays]
    assert supervisor.pids == {"/stays": stays.pid, "/goes": goes.pid}
    supervisor.stop()
    assert stays.exit_code() == 130
    assert stays.last_words() == "bye"


def test_first_process_ends_before_the_others_are_signalled(supervisor: Supervisor, tmp_path: Path) -> None:
    def script(name: str, delay: str) -> str:
        return (
            f"trap 'sleep {delay}; echo {name} >> {tmp_path}/order; exit 0' INT; "
            "echo ready; while :; do sleep 0.01; done"
        )

    others = [shell(supervisor, f"/other_{n}", script(f"other_{n}", "0")) for n in range(2)]
    recorder = shell(supervisor, "/recorder", script("recorder", "0.3"))
    wait_until(lambda: all(map(ready, [*others, recorder])))
    supervisor.stop(first=recorder)
    order = (tmp_path / "order").read_text().split()
    assert order[0] == "recorder"
    assert sorted(order[1:]) == ["other_0", "other_1"]


def test_process_that_ignores_sigint_is_killed_in_time(supervisor: Supervisor) -> None:
    stubborn, recorder = shell(supervisor, "/a", STUBBORN), shell(supervisor, "/recorder", STUBBORN)
    stopped = shell(supervisor, "/b", POLITE)
    wait_until(lambda: all(map(ready, [stubborn, recorder, stopped])))
    stopped.send(signal.SIGSTOP)
    began = time.monotonic()
    supervisor.stop(first=recorder)
    assert time.monotonic() - began < 3.0
    assert {child.exit_code() for child in (stubborn, recorder, stopped)} == {-signal.SIGKILL}


def test_children_of_a_child_are_ended_with_it(supervisor: Supervisor, tmp_path: Path) -> None:
    child = shell(supervisor, "/a", f"sleep 1000 & echo $! > {tmp_path}/pid; echo ready; trap '' INT; wait")
    wait_until(lambda: ready(child))
    supervisor.stop()
    pid = int((tmp_path / "pid").read_text())
    wait_until(
        lambda: not Path(f"/proc/{pid}/cmdline").exists() or not Path(f"/proc/{pid}/cmdline").read_bytes()
    )


def test_ctrl_c_of_the_terminal_does_not_reach_the_children(supervisor: Supervisor) -> None:
    child = shell(supervisor, "/a", POLITE)
    wait_until(lambda: ready(child))
    pid = child._process.pid
    assert os.getpgid(pid) != os.getpgid(0)
    assert os.getsid(pid) != os.getsid(0)
    supervisor.stop()


PARENT = """
import sys, time
from pathlib import Path
from relform_bringup.supervisor import Supervisor

supervisor = Supervisor(Path(sys.argv[1]))
supervisor.start("/a", ["sh", "-c", "echo $$; exec sleep 1000"])
recorder = "echo $$; trap 'echo closed; exit' INT; while :; do sleep 0.01; done"
supervisor.start("/recorder", ["sh", "-c", recorder], "INT")
time.sleep(1000)
"""


def test_no_process_outlives_a_killed_parent(tmp_path: Path) -> None:
    with subprocess.Popen([sys.executable, "-c", PARENT, str(tmp_path)]) as parent:
        logs = [tmp_path / "a.log", tmp_path / "recorder.log"]
        wait_until(lambda: all(log.exists() and log.read_text().strip().isdecimal() for log in logs))
        pids = [int(log.read_text()) for log in logs]
        parent.kill()
    wait_until(lambda: not any(Path(f"/proc/{pid}").exists() for pid in pids))
    assert logs[1].read_text().split()[-1] == "closed"


def test_program_that_cannot_be_started(supervisor: Supervisor, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(FlightError, match="package relform_nothing is not installed: run make setup"):
        executable("relform_nothing", "quadrotor")
    monkeypatch.setenv("PATH", "")
    with pytest.raises(FlightError, match="setpriv is not installed: apt install util-linux"):
        supervisor.start("/a", ["true"])
