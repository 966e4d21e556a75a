"""The recorder as a member of the barrier: the bag has every message of a flight, at its step."""

import contextlib
import re
import resource
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from relform_analysis.flight.from_bag import read_flight_log
from relform_analysis.flight.simulate import fly_in_process
from relform_bags.reader import BagMessage, read_bag
from relform_bags.recover import recover_bag
from relform_core.load import LoadedScenario
from relform_core.names import MEMBERS, RECORDER_NODE
from relform_core.roster import Roster
from relform_ros.topics import topic_table
from support.full_disk import complete_before_ns, tiny_disk
from support.scenarios import paper_scenario

WORKSPACE = Path(__file__).parents[2]
SHORT = (
    "phases=[{name: A, title: hover, duration_s: 0.5, steady_from_s: 0.0, formation: initial, "
    "motion: {kind: hover, ramp_s: 0.0}}]",
)
STEPS = 10
PERIOD_NS = 50_000_000
STATE = "/formation/state"
EXIT_FAULT = 3


@contextlib.contextmanager
def flight(
    scenario: LoadedScenario, folder: Path, bag: Path, limit_recorder: Callable[[], None] | None = None
) -> Iterator[dict[str, subprocess.Popen[str]]]:
    """Every node of a flight as a process; the folder is for its configuration."""
    config = folder / "config.yaml"
    config.write_text(scenario.effective_yaml)
    parameters = ["-p", f"scenario:={config}", "-p", f"observers:=['{RECORDER_NODE}']"]

    def start(package: str, executable: str, *arguments: str, **options: object) -> subprocess.Popen[str]:
        path = WORKSPACE / f"install/{package}/lib/{package}/{executable}"
        command = [str(path), "--ros-args", *parameters, *arguments]
        return subprocess.Popen(command, stderr=subprocess.PIPE, text=True, **options)

    nodes = {
        vehicle: start("relform_sim", "quadrotor", "-r", f"__ns:=/{vehicle}")
        for vehicle in scenario.config.team.vehicles
    }
    output = f"output:={bag}"
    nodes["recorder"] = start("relform_bags", "recorder", "-p", output, preexec_fn=limit_recorder)
    nodes["controller"] = start("relform_controller", "controller")
    nodes["clock"] = start("relform_sim", "clock")
    try:
        yield nodes
    finally:
        for node in nodes.values():
            node.kill()
            node.communicate()


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> tuple[LoadedScenario, Path]:
    folder = tmp_path_factory.mktemp("run")
    scenario = paper_scenario(*SHORT, seed=5)
    with flight(scenario, folder, folder / "bag") as nodes:
        for name in ("clock", "recorder"):
            _, errors = nodes[name].communicate(timeout=90.0)
            assert nodes[name].returncode == 0, errors
    return scenario, folder / "bag"


def test_every_message_at_its_step(recorded: tuple[LoadedScenario, Path]) -> None:
    scenario, folder = recorded
    table = topic_table(scenario.config, Roster.of(scenario.config, [RECORDER_NODE]))
    expected = {topic.name for topic in table.values() if RECORDER_NODE in topic.readers}
    steps: dict[str, list[int]] = {name: [] for name in expected}
    for entry in read_bag(folder / "bag_0.mcap"):
        if isinstance(entry, BagMessage):
            step, remainder = divmod(entry.log_time_ns, scenario.config.period_ns)
            assert remainder == 0
            steps[entry.topic].append(step)
    decided, everything = list(range(STEPS)), list(range(STEPS + 1))
    for name in expected - {"/diagnostics"}:
        last = name.rpartition("/")[2]
        if last == "step_done":
            assert steps[name] == [0, 0, *everything]  # JOINED and READY are sent at time 0
        elif last in {"rotor_speeds", "state", "solver", "reference", "events"}:
            assert steps[name] == decided, name
        elif name == MEMBERS:
            assert steps[name] == [], "nobody has joined the running flight"
        else:
            assert steps[name] == everything, name
    assert steps["/diagnostics"]


def test_bag_holds_the_flight_bit_for_bit(recorded: tuple[LoadedScenario, Path]) -> None:
    scenario, folder = recorded
    expected, log = fly_in_process(scenario), read_flight_log(folder)
    assert log.scenario.config == scenario.config
    assert log.scenario.seed == 5
    for name in (
        "p_NB_N",
        "q_NB",
        "v_NB_B",
        "w_NB_B",
        "rotor_speeds",
        "p_BB_C__ref",
        "p_BB_C__est",
        "yaw_BB__est",
    ):
        np.testing.assert_array_equal(getattr(log, name), getattr(expected, name), err_msg=name)
    for name in ("kkt", "objective", "sqp_steps", "status"):
        np.testing.assert_array_equal(log.solver[name], expected.solver[name], err_msg=name)


def end_of_recording(folder: Path, bag: Path, limit: Callable[[], None] | None = None) -> tuple[str, int]:
    """Fly until the recorder cannot write; returns its only line and the step of its fault."""
    scenario = paper_scenario(SHORT[0].replace("0.5", "27.0"))
    with flight(scenario, folder, bag, limit) as nodes:
        _, clock_errors = nodes["clock"].communicate(timeout=90.0)
        _, recorder_errors = nodes["recorder"].communicate(timeout=10.0)
    (line,) = recorder_errors.splitlines()
    assert nodes["recorder"].returncode == 1
    assert nodes["clock"].returncode == EXIT_FAULT
    reason = line.removeprefix(f"{RECORDER_NODE}: ")
    assert reason in clock_errors
    match = re.search(rf"{RECORDER_NODE} in step (\d+)", clock_errors)
    assert match
    return line, int(match[1])


def newest_step(bag: Path, name: str) -> int:
    """The newest step of a topic."""
    times = [e.log_time_ns for e in read_bag(bag) if isinstance(e, BagMessage) and e.topic == name]
    assert [time // PERIOD_NS for time in times] == list(range(len(times))), "without a gap"
    return len(times) - 1


def test_full_disk_ends_the_flight_and_loses_nothing(tmp_path: Path) -> None:
    with tiny_disk(tmp_path / "disk") as disk:
        line, step = end_of_recording(tmp_path, disk / "bag")
        assert "cannot be written any more: No space left on device; the bag holds every message" in line
        newest = complete_before_ns(line) // PERIOD_NS
        assert newest in (step, step + 1), "the flight may be one step ahead of its recorder"
        for name in ("/clock", "/leader/imu", "/leader/rotor_speeds", "/follower_1/ground_truth", STATE):
            assert step <= newest_step(disk / "bag", name) <= newest, name
        assert newest_step(disk / "bag", "/clock") == newest, "nothing that was received is lost"
        assert recover_bag(disk / "bag") is False, "it is complete"
        log = read_flight_log(disk / "bag")
    assert step + 1 <= len(log.phase) <= newest + 1


def test_limit_of_the_file_size_ends_the_flight_and_names_what_is_kept(tmp_path: Path) -> None:
    def limit() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (700_000, 700_000))

    bag = tmp_path / "bag"
    line, step = end_of_recording(tmp_path, bag, limit)
    assert "cannot be written any more: File too large; the bag holds every message" in line
    first_lost, remainder = divmod(complete_before_ns(line), PERIOD_NS)
    assert remainder == 0
    assert 0 < first_lost <= step
    for name in ("/clock", "/leader/imu", "/follower_1/ground_truth", STATE):
        assert first_lost - 1 <= newest_step(bag, name) <= step + 1, name
    assert len(read_flight_log(bag).phase) >= first_lost
