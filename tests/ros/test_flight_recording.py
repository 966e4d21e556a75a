"""The recorder as a member of the barrier: every message of a flight is in the bag, at its step."""

import contextlib
import resource
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from relform_analysis.flight.from_bag import read_flight_log
from relform_analysis.flight.simulate import fly_in_process
from relform_bags.reader import BagMessage, read_bag
from relform_core.load import LoadedScenario
from relform_core.names import RECORDER_NODE
from relform_ros.topics import topic_table
from support.processes import without_middleware
from support.scenarios import paper_scenario

WORKSPACE = Path(__file__).parents[2]
SHORT = (
    "phases=[{name: A, title: hover, duration_s: 0.5, steady_from_s: 0.0, formation: initial, "
    "motion: {kind: hover, ramp_s: 0.0}}]",
)
STEPS = 10
EXIT_FAULT = 3


@contextlib.contextmanager
def flight(
    scenario: LoadedScenario, folder: Path, limit_recorder: Callable[[], None] | None = None
) -> Iterator[dict[str, subprocess.Popen[str]]]:
    """Every node of a flight as a process, the bag in ``folder / "bag"``."""
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
    output = f"output:={folder / 'bag'}"
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
    with flight(scenario, folder) as nodes:
        for name in ("clock", "recorder"):
            _, errors = nodes[name].communicate(timeout=90.0)
            assert nodes[name].returncode == 0, errors
    return scenario, folder / "bag"


def test_every_message_at_its_step(recorded: tuple[LoadedScenario, Path]) -> None:
    scenario, folder = recorded
    table = topic_table(scenario.config, [RECORDER_NODE])
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


def test_full_disk_ends_the_flight_and_says_why(tmp_path: Path) -> None:
    def limit() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (280_000, 280_000))

    long = SHORT[0].replace("0.5", "27.0")
    with flight(paper_scenario(long), tmp_path, limit) as nodes:
        _, clock_errors = nodes["clock"].communicate(timeout=90.0)
        _, recorder_errors = nodes["recorder"].communicate(timeout=10.0)
    recorder_errors = without_middleware(recorder_errors)  # which cannot make its shared memory
    assert nodes["recorder"].returncode == 1
    assert "File too large" in recorder_errors
    assert recorder_errors.count("\n") == 1
    assert nodes["clock"].returncode == EXIT_FAULT
    assert RECORDER_NODE in clock_errors
    assert "File too large" in clock_errors
    log = read_flight_log(tmp_path / "bag")  # what there is of it
    assert 0 < len(log.phase) < 540
