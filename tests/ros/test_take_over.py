"""Real processes in real time: the controller is killed and started again, and others want to join.

The flight is one: the controller is killed, a new one takes over; a second controller and a vehicle that is
started twice are refused; the controller is killed for good, and the vehicles land.
"""

import os
import re
import signal
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import domain_coordinator
import pytest
from rosgraph_msgs.msg import Clock

from relform_analysis.flight.from_bag import read_flight_log
from relform_analysis.flight.log import FlightLog
from relform_analysis.replay.command import EQUAL
from relform_analysis.replay.command import main as replay
from relform_core.names import (
    CLOCK,
    CONTROLLER_NODE,
    MEMBERS,
    RECORDER_NODE,
    vehicle_node,
)
from relform_msgs.msg import FormationState, MemberChange
from relform_ros.qos import LATCHED
from support.nodes import Nodes, short
from support.observer import Observer
from support.processes import processes_naming, wait_until
from support.scenarios import paper_scenario

SCENARIO = paper_scenario(
    short(60.0),
    "controller=team",
    "pacing=real_time",
    "start.position_m=[0.5, -0.3, 4.0]",
    "vehicle.failsafe={plan_max_s: 1.0, descent_speed_m_s: 0.5}",
    "lockstep.step_timeout_s=3",
    seed=7,
)
PERIOD = SCENARIO.config.controller.period
FLY = Path(__file__).parents[2] / "scripts/fly.py"
LEADER = vehicle_node("leader")
EXIT_ERROR, EXIT_SILENT = 1, 2


@dataclass
class Flown:
    """What was seen from outside."""

    changes: list[MemberChange]
    states: list[FormationState]
    killed_step: int
    ends: dict[str, tuple[int, str]]
    log: FlightLog
    bag: Path


@pytest.fixture(scope="module")
def flown(tmp_path_factory: pytest.TempPathFactory) -> Flown:
    folder = tmp_path_factory.mktemp("flight")
    with (
        domain_coordinator.domain_id() as domain_id,
        Observer.running(domain_id) as observer,
        Nodes(SCENARIO, folder, domain_id, observers=[RECORDER_NODE]) as nodes,
    ):
        ticks = observer.collect(Clock, CLOCK)
        changes = observer.collect(MemberChange, MEMBERS, LATCHED)
        states = observer.collect(FormationState, "/formation/state")
        for name in (*SCENARIO.config.team.vehicles, "controller", "clock"):
            nodes.start(name)
        nodes.start("recorder", f"output:={folder / 'bag'}")
        observer.until(lambda: len(ticks) > 25)
        first = nodes.processes["controller"]
        first.kill()
        first.communicate()
        killed_step, n_states = states[-1].step, len(states)
        again = nodes.start("controller")
        observer.until(lambda: len(states) > n_states + 20)
        ends = {}
        leader = nodes.processes["leader"]
        nodes.start("controller")
        nodes.start("leader")
        for name in ("controller", "leader"):
            ends[f"second {name}"] = nodes.end(name)
        nodes.processes |= {"controller": again, "leader": leader}
        n_states = len(states)
        observer.until(lambda: len(states) > n_states + 5)
        again.send_signal(signal.SIGKILL)
        ends |= nodes.ends()
    return Flown(changes, states, killed_step, ends, read_flight_log(folder / "bag"), folder / "bag")


def test_a_controller_that_was_started_again_is_admitted_and_takes_over(flown: Flown) -> None:
    admitted = [change for change in flown.changes if change.kind == MemberChange.ADMITTED]
    assert [change.node for change in admitted] == [CONTROLLER_NODE]
    assert admitted[0].reason.startswith(f"nothing was heard from {CONTROLLER_NODE} for ")
    first = next(state for state in flown.states if state.step > flown.killed_step)
    assert (first.step - admitted[0].step) * PERIOD < 1.0
    assert ("/formation/controller", "takes the team over") in [
        (change.source, change.description) for change in flown.log.changes
    ]


def test_the_team_is_in_place_again(flown: Flown) -> None:
    last = flown.states[-1]
    assert last.leader_position_error < 0.15
    assert flown.log.faults == ()


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("controller", f"another process is {CONTROLLER_NODE} and takes part"),
        ("leader", "the flight runs, and goes on without this process"),
    ],
)
def test_a_second_node_of_a_name_is_refused_and_disturbs_nothing(
    name: str, reason: str, flown: Flown
) -> None:
    node = CONTROLLER_NODE if name == "controller" else LEADER
    (refused,) = (
        change for change in flown.changes if change.kind == MemberChange.REFUSED and change.node == node
    )
    assert refused.reason == reason
    code, errors = flown.ends[f"second {name}"]
    assert code == EXIT_ERROR
    assert errors.splitlines()[-1] == f"{node}: refused in step {refused.step}: {reason}"


def test_without_a_controller_the_vehicles_land_and_the_flight_ends_with_the_reason(flown: Flown) -> None:
    code, errors = flown.ends["clock"]
    assert code == EXIT_SILENT
    assert errors.splitlines()[-1].endswith(
        "all vehicles are on the ground, and nothing was heard for 3 s (lockstep.step_timeout_s) from: "
        f"{CONTROLLER_NODE}"
    )
    assert (flown.log.p_NB_N[-1, :, 2] < 0.11).all()


def test_the_whole_flight_is_in_the_bag_and_is_replayed_bit_for_bit(flown: Flown) -> None:
    assert replay([str(flown.bag)]) == EQUAL


def test_fly_starts_a_controller_again_that_was_killed(tmp_path: Path) -> None:
    folder = tmp_path / "run"
    overrides = (short(10.0), "controller=team", "start.position_m=[0.0, 0.0, 4.0]")
    command = [sys.executable, str(FLY), "--scenario", "paper", "--real-time", "--out", str(folder)]
    for override in overrides:
        command += ["--set", override]
    shown = tmp_path / "shown.txt"
    with (
        shown.open("wb") as out,
        subprocess.Popen(command, stdout=out, stderr=subprocess.STDOUT) as fly,
    ):
        try:
            wait_until(lambda: " / 10.0 s" in shown.read_text(), timeout_s=60.0)
            (controller,) = (
                pid
                for pid, line in processes_naming(str(folder)).items()
                if "lib/relform_controller/controller" in line
            )
            os.kill(controller, signal.SIGKILL)
            fly.wait(timeout=60.0)
        finally:
            fly.kill()
    text = shown.read_text()
    assert fly.returncode == 0, text
    assert re.search(r"/formation/controller was killed by SIGKILL in step \d+ .*: starting it again", text)
    assert "takes the team over" in [change.description for change in read_flight_log(folder).changes]
