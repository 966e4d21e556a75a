"""Flights on the wall clock with real processes: they are flown to the end, recorded and replayed."""

import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import domain_coordinator
import pytest
from diagnostic_msgs.msg import DiagnosticArray
from rosgraph_msgs.msg import Clock

from relform_analysis.flight.from_bag import read_flight_log
from relform_analysis.replay.command import EQUAL
from relform_analysis.replay.command import main as replay
from relform_bags.from_bag import decode
from relform_bags.reader import BagMessage, find_bag, read_bag
from relform_core.names import CLOCK, CLOCK_NODE, CONTROLLER_NODE, DIAGNOSTICS, RECORDER_NODE, vehicle_node
from support.nodes import Nodes, short
from support.observer import Observer
from support.scenarios import paper_scenario

FLY = Path(__file__).parents[2] / "scripts/fly.py"
FLIGHT_S = 4.0
STOP_STEPS = 11
SCENARIO = paper_scenario(short(FLIGHT_S), "controller.estimator=team", "pacing=real_time", seed=7)
CONFIG = SCENARIO.config
VEHICLES = CONFIG.team.vehicles


@pytest.fixture(scope="module")
def flown(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, float]:
    """The bag of a flight whose controller is stopped for some steps, and its wall time [s]."""
    folder = tmp_path_factory.mktemp("flight")
    with (
        domain_coordinator.domain_id() as domain_id,
        Observer.running(domain_id) as observer,
        Nodes(SCENARIO, folder, domain_id, observers=[RECORDER_NODE]) as nodes,
    ):
        ticks = observer.collect(Clock, CLOCK)
        for name in (*VEHICLES, "controller", "clock"):
            nodes.start(name)
        nodes.start("recorder", f"output:={folder / 'bag'}")
        observer.until(lambda: len(ticks) > 0)
        began = time.monotonic()
        observer.until(lambda: len(ticks) > 20)
        nodes.processes["controller"].send_signal(signal.SIGSTOP)
        stop = len(ticks) + STOP_STEPS
        observer.until(lambda: len(ticks) >= stop)
        nodes.processes["controller"].send_signal(signal.SIGCONT)
        ends = nodes.ends()
        took = time.monotonic() - began
    assert {code for code, _ in ends.values()} == {0}, ends
    return folder / "bag", took


def reported(bag: Path) -> dict[str, dict[str, str]]:
    """The last diagnostics of each node."""
    last = {}
    for entry in read_bag(find_bag(bag), {DIAGNOSTICS}):
        if isinstance(entry, BagMessage):
            message: DiagnosticArray = decode(entry)
            for status in message.status:
                last[status.name] = {each.key: each.value for each in status.values}
    return last


def test_a_flight_takes_its_time(flown: tuple[Path, float]) -> None:
    _, took = flown
    assert took > FLIGHT_S - 0.5


def test_a_stopped_controller_misses_steps_and_the_vehicles_fly_its_plan(flown: tuple[Path, float]) -> None:
    reports = reported(flown[0])
    assert int(reports[CONTROLLER_NODE]["real_time.skipped_steps"]) > 0  # it may catch up on some of them
    assert int(reports[CLOCK_NODE][f"real_time.missed_steps.{CONTROLLER_NODE}"]) >= STOP_STEPS - 2
    for name in VEHICLES:
        counts = reports[vehicle_node(name)]
        assert int(counts["missing"]) >= STOP_STEPS - 2
        assert int(counts["replayed"]) > 0
        assert int(counts["real_time.skipped_steps"]) == 0
        assert 0.0 < float(counts["real_time.age_median_ms"]) <= float(counts["real_time.age_most_ms"])


def test_every_step_of_the_world_is_recorded(flown: tuple[Path, float]) -> None:
    log = read_flight_log(flown[0])
    assert len(log.tick_ns) == CONFIG.n_steps + 1
    assert not log.faults
    assert len(log.phase) < CONFIG.n_steps


def test_the_flight_is_replayed_bit_for_bit(
    flown: tuple[Path, float], capsys: pytest.CaptureFixture[str]
) -> None:
    assert replay([str(flown[0])]) == EQUAL
    assert "every command is equal, bit for bit" in capsys.readouterr().out


def test_fly_composes_and_reports_a_flight_in_real_time(tmp_path: Path) -> None:
    folder = tmp_path / "run"
    arguments = [
        "--scenario",
        "paper",
        "--real-time",
        "--composed",
        "--out",
        str(folder),
        "--set",
        short(2.0),
    ]
    fly = subprocess.run(
        [sys.executable, str(FLY), *arguments], capture_output=True, text=True, timeout=90, check=False
    )
    assert fly.returncode == 0, fly.stderr
    summary = json.loads((folder / "summary.json").read_text())
    assert set(summary["real_time"]["missed_steps"]) == set(reported(folder)) - {CLOCK_NODE}
    assert 0.0 < summary["real_time"]["command_age_median_ms"] <= summary["real_time"]["command_age_max_ms"]
    assert "command age, 50/99/100 %" in fly.stdout
    assert replay([str(folder)]) == EQUAL
