"""scripts/fly.py as a user runs it: the files of a run, and every way in which a flight ends."""

import json
import os
import re
import shlex
import signal
import subprocess
import sys
import time
from collections import defaultdict
from collections.abc import Callable, Iterator
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np
import pytest

from relform_analysis.flight.from_bag import read_flight_log
from relform_analysis.flight.log import FlightLog
from relform_analysis.flight.metrics import flight_metrics
from relform_analysis.flight.simulate import fly_in_process
from relform_analysis.flight.summary import Ending, Outcome, build_summary
from relform_analysis.replay.command import EQUAL
from relform_analysis.replay.command import main as replay
from relform_bags.from_bag import decode
from relform_bags.reader import BagMessage, find_bag, read_bag
from relform_core.load import load_scenario
from relform_core.names import SOLVER
from support.nodes import short
from support.processes import processes_naming, wait_until
from support.scenarios import PAPER

WORKSPACE = Path(__file__).parents[2]
FLY = WORKSPACE / "scripts/fly.py"
EXIT_FAILED, EXIT_BAD_INPUT, EXIT_FAULT, EXIT_INTERRUPTED = 1, 2, 3, 130
LONG = short(60.0)
END_S = 3.0


class Fly:
    """One run of the script; the test fails if a process of it is left at the end."""

    def __init__(
        self, folder: Path, *arguments: str, overrides: tuple[str, ...] = (), by_make: bool = False
    ) -> None:
        self.folder = folder
        self._out, self._err = folder.with_suffix(".out"), folder.with_suffix(".err")
        options = ["--out", str(folder), *arguments]
        for override in overrides:
            options += ["--set", override]
        if by_make:
            command = ["make", "-C", str(WORKSPACE), "demo", f"ARGS={shlex.join(options)}"]
        else:
            command = [sys.executable, str(FLY), "--scenario", str(PAPER), *options]
        environment = {name: value for name, value in os.environ.items() if name != "ROS_DOMAIN_ID"}
        with self._out.open("wb") as out, self._err.open("wb") as err:
            self.process = subprocess.Popen(command, env=environment, stdout=out, stderr=err)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.process.kill()
        self.process.wait()
        wait_until(lambda: processes_naming(str(self.folder)) == {}, timeout_s=END_S)

    @property
    def out(self) -> str:
        return self._out.read_text()

    @property
    def err(self) -> str:
        return self._err.read_text()

    @property
    def summary(self) -> dict[str, Any]:
        summary: dict[str, Any] = json.loads((self.folder / "summary.json").read_text())
        return summary

    def end(self, timeout_s: float = 90.0) -> int:
        """Wait for the end and return the exit code; no process may be left."""
        code = self.process.wait(timeout_s)
        assert processes_naming(str(self.folder)) == {}
        return code

    def in_the_air(self) -> None:
        """Wait until some steps were flown."""
        wait_until(lambda: " / 60.0 s" in self.out and (self.folder / "bag").exists())
        size = self.bag_size()
        wait_until(lambda: self.bag_size() > size)

    def bag_size(self) -> int:
        return sum(file.stat().st_size for file in (self.folder / "bag").glob("*.mcap"))

    def node(self, *marks: str) -> int:
        """Process id of the node with all these texts in its command line."""
        commands = processes_naming(str(self.folder))
        (pid,) = [pid for pid, command in commands.items() if all(mark in command for mark in marks)]
        return pid


@pytest.fixture
def fly(tmp_path: Path) -> Iterator[Callable[..., Fly]]:
    flights: list[Fly] = []

    def start(*arguments: str, overrides: tuple[str, ...] = (LONG,), by_make: bool = False) -> Fly:
        folder = tmp_path / f"run {len(flights)}: #1"
        flights.append(Fly(folder, *arguments, overrides=overrides, by_make=by_make))
        return flights[-1]

    yield start
    for flight in flights:
        flight.__exit__(None, None, None)


@pytest.fixture(scope="module")
def flown(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Fly]:
    """Short flights: three with one seed, one of them drawn, one in one process; one without a recorder."""
    folder = tmp_path_factory.mktemp("flown")
    flights = {}
    for name, arguments in (
        ("first", ("--seed", "3")),
        ("second", ("--seed", "3", "--visualize")),
        ("composed", ("--seed", "3", "--composed")),
        ("other", ("--seed", "4", "--no-record")),
    ):
        with Fly(folder / name, *arguments, overrides=(short(1.0),)) as flight:
            assert flight.end() == 0, flight.err
        flights[name] = flight
    return flights


def test_files_of_a_run(flown: dict[str, Fly]) -> None:
    flight = flown["first"]
    names = {path.name for path in flight.folder.iterdir()}
    assert {"bag", "config.yaml", "flight.png", "log", "summary.json"} <= names
    assert {path.name for path in (flight.folder / "bag").iterdir()} == {"bag_0.mcap", "metadata.yaml"}
    assert {path.read_text() for path in (flight.folder / "log").iterdir()} == {""}  # nobody complained
    assert load_scenario(flight.folder / "config.yaml").seed == 3
    assert flight.err == ""
    summary = flight.summary
    assert (summary["outcome"], summary["reason"]) == ("completed", None)
    assert (summary["steps"], summary["steps_planned"], summary["flown_s"]) == (20, 20, 1.0)
    assert 0.0 < summary["steady_mean_m"] < 0.3
    assert summary["realtime_factor"] == pytest.approx(1.0 / summary["wall_s"])


def test_output_of_a_flight(flown: dict[str, Fly]) -> None:
    lines = flown["first"].out.splitlines()
    assert lines[0].startswith("starting 6 nodes, ROS_DOMAIN_ID=")
    # The error is that of a step of which all has come in: at the first line there may be none yet.
    assert re.fullmatch(r"A hover +0\.00 / 1\.0 s( +formation error 0\.000 m)? *", lines[1])
    assert "paper, seed 3: completed, 20 of 20 control steps" in " ".join(flown["first"].out.split())
    assert lines[-1].startswith(str(flown["first"].folder))


def test_same_seed_gives_the_same_flight_bit_for_bit(flown: dict[str, Fly]) -> None:
    first, second = (read_flight_log(flown[name].folder) for name in ("first", "second"))
    expected = fly_in_process(load_scenario(flown["first"].folder / "config.yaml"))
    for log in (second, expected):
        for name in ("rotor_speeds", "p_NB_N", "q_NB"):
            assert getattr(first, name).tobytes() == getattr(log, name).tobytes(), name


def test_scenario_is_equal_with_ros_without_ros_and_replayed(fly: Callable[..., Fly]) -> None:
    """It is flown by `make demo`, and does not need what draws it, which is killed."""
    flight = fly("--seed", "5", "--visualize", overrides=(), by_make=True)
    drawing = "lib/relform_bringup/visualization"
    wait_until(lambda: any(drawing in command for command in processes_naming(str(flight.folder)).values()))
    os.kill(flight.node(drawing), signal.SIGKILL)
    assert flight.end() == 0, flight.err
    assert "/visualization was killed by SIGKILL" in flight.out
    scenario = load_scenario(PAPER, ["controller=team"], seed=5)
    commands = read_flight_log(flight.folder).rotor_speeds
    assert commands.shape == (scenario.config.n_steps, 3, 4)
    assert commands.tobytes() == fly_in_process(scenario).rotor_speeds.tobytes()
    assert replay([str(flight.folder)]) == EQUAL


def test_composed_nodes_send_the_same_messages(flown: dict[str, Fly]) -> None:
    """All but the times that the solver took."""
    composed, apart = (recorded_messages(flown[name].folder) for name in ("composed", "first"))
    assert len(apart[SOLVER]) == len(composed[SOLVER]) == 20
    for topic in apart.keys() - {SOLVER}:
        assert composed[topic] == apart[topic], topic
    assert composed.keys() == apart.keys()
    flight = flown["composed"]
    assert flight.out.startswith("starting 6 nodes in one process, ROS_DOMAIN_ID=")
    logs = {path.name: path.read_text() for path in (flight.folder / "log").iterdir()}
    assert logs == {"composed.log": ""}


def recorded_messages(run: Path) -> dict[str, list[str]]:
    """Messages of a flight by topic, sorted, because writers of one topic have no order."""
    messages = defaultdict(list)
    for entry in read_bag(find_bag(run)):
        if isinstance(entry, BagMessage):
            messages[entry.topic].append(repr(decode(entry)))  # bytes between fields may differ
    return {topic: sorted(each) for topic, each in messages.items()}


def test_without_a_recorder(flown: dict[str, Fly]) -> None:
    flight = flown["other"]
    assert not (flight.folder / "bag").exists()
    assert flight.out.startswith("starting 5 nodes")
    assert flight.summary["steps"] == 20
    # Another seed, another flight; the same classes in one process fly it too.
    assert flight.summary["mean_m"] != flown["first"].summary["mean_m"]
    expected = fly_in_process(load_scenario(flight.folder / "config.yaml"))
    assert flight.summary["rotor_mean_rpm"] == pytest.approx(mean_rpm(expected), rel=1e-12)


@pytest.mark.parametrize("name", ["first", "composed"])
def test_summary_has_all_that_the_bag_has(name: str, flown: dict[str, Fly]) -> None:
    log, summary = read_flight_log(flown[name].folder), flown[name].summary
    ending = Ending(Outcome.COMPLETED, None, summary["wall_s"], summary["flown_s"])
    assert summary == build_summary(log.scenario, flight_metrics(log), ending, summary["versions"])


def mean_rpm(log: FlightLog) -> float:
    return float(np.mean(log.rotor_speeds)) * 60.0 / (2.0 * np.pi)


def test_existing_folder_is_not_changed(tmp_path: Path) -> None:
    folder = tmp_path / "there"
    folder.mkdir()
    with Fly(folder) as flight:
        assert flight.end() == EXIT_BAD_INPUT
    assert flight.err == f"error: {folder} exists already; choose another folder\n"
    assert list(folder.iterdir()) == []


@pytest.mark.parametrize("when", ["early", "nodes", "in flight", "in flight, composed"])
def test_interrupted(when: str, fly: Callable[..., Fly]) -> None:
    flight = fly(*(["--composed"] if "composed" in when else []))
    match when:
        case "early":
            wait_until(flight.folder.exists)
        case "nodes":
            wait_until(lambda: len(processes_naming(str(flight.folder))) == 7)
        case _:
            flight.in_the_air()
    began = time.monotonic()
    flight.process.send_signal(signal.SIGINT)
    assert flight.end() == EXIT_INTERRUPTED
    assert time.monotonic() - began < END_S
    assert flight.err == "interrupted by SIGINT\n"
    summary = flight.summary
    assert (summary["outcome"], summary["reason"]) == ("interrupted", "interrupted by SIGINT")
    if "in flight" in when:
        assert summary["steps"] > 0
        assert f"open {flight.folder / 'report.html'}" in flight.out.splitlines()
        assert (flight.folder / "report.html").exists()
        assert len(read_flight_log(flight.folder).phase) >= summary["steps"]


@pytest.mark.parametrize(
    ("marks", "name"),
    [
        (("lib/relform_sim/quadrotor", "__ns:=/leader"), "/leader/quadrotor"),
        (("lib/relform_controller/controller",), "/formation/controller"),
        (("lib/relform_sim/clock",), "/sim/clock"),
        (("lib/relform_bags/recorder",), "/recorder"),
        (("lib/relform_bringup/composed",), "the process of all nodes"),
    ],
    ids=["vehicle", "controller", "clock", "recorder", "composed"],
)
def test_lost_node_is_named(marks: tuple[str, ...], name: str, fly: Callable[..., Fly]) -> None:
    flight = fly(*(["--composed"] if "composed" in marks[0] else []))
    flight.in_the_air()
    os.kill(flight.node(*marks), signal.SIGKILL)
    assert flight.end() == EXIT_FAILED
    summary = flight.summary
    match = re.fullmatch(rf"error: {name} was killed by SIGKILL in step (\d+) \((.*) s\)\n", flight.err)
    assert match is not None, flight.err
    step = int(match[1])
    assert float(match[2]) == pytest.approx(step * 0.05)
    assert abs(summary["steps"] - step) <= 1  # it may have died within a step
    assert (summary["outcome"], summary["reason"]) == ("failed", flight.err.strip().removeprefix("error: "))
    recorded = len(read_flight_log(flight.folder).phase)
    if name in ("/recorder", "the process of all nodes"):
        assert recorded > 0  # its last chunk is lost
    else:  # a message of the last step that reached the monitor first can die with its sender
        assert recorded >= summary["steps"] - 1


@pytest.mark.parametrize(
    ("mark", "arguments", "reason"),
    [
        ("lib/relform_bags/recorder", (), r"step \d+ \(.* s\) not finished within 2 s .*: /recorder"),
        ("lib/relform_sim/clock", (), r"/sim/clock has finished no step for 4 s"),
        (
            "lib/relform_bringup/composed",
            ("--composed",),
            r"the process of all nodes has finished no step for 4 s",
        ),
    ],
    ids=["recorder", "clock", "composed"],
)
def test_process_that_hangs_ends_the_flight(
    mark: str, arguments: tuple[str, ...], reason: str, fly: Callable[..., Fly]
) -> None:
    flight = fly(*arguments, overrides=(LONG, "lockstep.step_timeout_s=2.0"))
    flight.in_the_air()
    os.kill(flight.node(mark), signal.SIGSTOP)
    assert flight.end() == EXIT_FAILED
    assert re.fullmatch(f"error: {reason}\n", flight.err), flight.err
    assert flight.summary["steps"] > 0
    assert len(read_flight_log(flight.folder).phase) > 0


@pytest.mark.parametrize("arguments", [(), ("--composed",)], ids=["apart", "composed"])
def test_no_process_outlives_the_script(arguments: tuple[str, ...], fly: Callable[..., Fly]) -> None:
    flight = fly(*arguments)
    flight.in_the_air()
    flight.process.kill()
    flight.process.wait()
    wait_until(lambda: processes_naming(str(flight.folder)) == {}, timeout_s=END_S)
    assert (flight.folder / "bag/metadata.yaml").exists()
    assert len(read_flight_log(flight.folder).phase) > 0


@pytest.mark.parametrize("arguments", [(), ("--composed",)], ids=["apart", "composed"])
def test_fault_ends_the_flight(arguments: tuple[str, ...], fly: Callable[..., Fly]) -> None:
    fall = "events=[{kind: thrust_scale, start_s: 0.5, end_s: 9.0, target: follower_2, scale: 0.2}]"
    flight = fly(*arguments, overrides=(LONG, fall))
    assert flight.end() == EXIT_FAULT
    summary = flight.summary
    assert summary["outcome"] == "fault"
    assert summary["reason"].startswith("/follower_2/quadrotor in step ")
    assert flight.err == f"error: {summary['reason']}\n"
    assert 0.5 < summary["flown_s"] < 5.0
    assert [fault.source for fault in read_flight_log(flight.folder).faults] == ["follower_2"]
    assert (flight.folder / "flight.png").exists()
