"""The view of recordings, and of a flight that it starts."""

import os
import signal
import socket
import subprocess
import sys
from pathlib import Path

import pytest

from relform_core.units import NANOSECONDS_PER_SECOND
from relform_live.from_bag import read_recording
from relform_live.scene.stage import Stage
from support.ports import free_port
from support.processes import listening_addresses, processes_naming, wait_until

WORKSPACE = Path(__file__).parents[2]
LOOPBACK, LOOPBACK_6 = "0100007F", "00000000000000000000000001000000"
"""127.0.0.1 and ::1 as in /proc/net."""
SCRIPT = [sys.executable, str(WORKSPACE / "scripts/live.py")]


@pytest.mark.parametrize("bag", ["short_flight", "older_flight"])
def test_a_recording_shows_the_flight(bag: str) -> None:
    recording = read_recording(WORKSPACE / "tests/data" / bag)
    stage = Stage(recording.data)
    end_ns = recording.end_ns
    assert end_ns == pytest.approx(2.0 * NANOSECONDS_PER_SECOND, rel=0.5)
    recording.advance(stage, end_ns)
    picture = stage.picture(end_ns)
    assert picture.truth is not None
    assert picture.truth.p_NB_N.shape == (3, 3)
    assert 0.0 < max(recording.data.formation_errors().values()) < 0.5
    assert all(recording.data.sees(observer, target) for observer, target in stage.edges)


def test_starts_a_flight_and_shows_it_until_the_user_ends_it(tmp_path: Path) -> None:
    out = tmp_path / "flight"
    options = ["--scenario", "paper", "--set", "phases.0.duration_s=1.0", "--composed", "--out", str(out)]
    process = start("--port", str(free_port()), "--fly", *options)
    assert process.stdout is not None
    assert process.stdout.readline().startswith("open http://localhost:")
    wait_until((out / "bag/bag_0.mcap").exists, timeout_s=60.0)
    listening = [found for pid in processes_naming(str(out)) if (found := listening_addresses(pid))]
    assert len(listening) >= 2, "the view, and the nodes in one process"
    assert set().union(*listening) <= {LOOPBACK, LOOPBACK_6}
    wait_until((out / "flight.png").exists, timeout_s=90.0)
    wait_until(lambda: set(processes_naming(str(out))) == {process.pid})  # the flight has ended
    process.send_signal(signal.SIGINT)
    printed, complaints = process.communicate(timeout=30.0)
    assert process.returncode == 0, complaints
    assert "formation error" in printed


def test_a_flight_that_cannot_start_ends_the_view() -> None:
    process = start("--port", str(free_port()), "--fly", "--scenario", "nowhere")
    _, complaints = process.communicate(timeout=60.0)
    assert process.returncode == 2
    (line,) = complaints.splitlines()
    assert line.startswith("error: ")
    assert "nowhere" in line


def test_nothing_flies_if_the_port_is_in_use(tmp_path: Path) -> None:
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = other.getsockname()[1]
        process = start(
            "--port", str(port), "--fly", "--scenario", "paper", "--out", str(tmp_path / "flight")
        )
        printed, complaints = process.communicate(timeout=60.0)
    assert (process.returncode, printed) == (2, "")
    assert complaints == f"error: port {port} is in use; choose another one with --port\n"
    assert list(tmp_path.iterdir()) == []


def start(*arguments: str) -> subprocess.Popen[str]:
    # Another domain than that of the tests: the flight takes a free one.
    environment = {key: value for key, value in os.environ.items() if key != "ROS_DOMAIN_ID"}
    return subprocess.Popen(
        [*SCRIPT, *arguments], env=environment, text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )
