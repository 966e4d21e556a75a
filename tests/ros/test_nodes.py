"""Nodes started by hand: in any order, with one missing, silent or interrupted, beside another flight."""

import re
import signal
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path

import domain_coordinator
import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import Vector3
from nav_msgs.msg import Odometry
from rclpy.serialization import serialize_message
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Imu

from relform_analysis.flight.from_bag import read_flight_log
from relform_analysis.flight.simulate import fly_in_process
from relform_core.names import (
    CONTROLLER_NODE,
    DIAGNOSTICS,
    EVENTS,
    RECORDER_NODE,
    REFERENCE,
    step_done_topic,
    vehicle_node,
)
from relform_msgs.msg import FormationEvent, FormationReference, RelativePosition, RotorSpeeds, StepDone
from relform_msgs.srv import SetFormation
from relform_ros.fields import stamp_from_msg, stamp_to_msg
from relform_ros.qos import LATCHED, LOCKSTEP
from support.nodes import INSTALL, Nodes, short
from support.observer import Observer
from support.scenarios import paper_scenario

VEHICLES = ("leader", "follower_1", "follower_2")
FLOOD = 40
"""Messages at a time, of those that are sent ten times as often as the vehicles send theirs."""
EXIT_ERROR, EXIT_SILENT, EXIT_INTERRUPTED = 1, 2, 130


@pytest.fixture
def domain_id() -> Iterator[int]:
    with domain_coordinator.domain_id() as domain:
        yield domain


@pytest.fixture
def observer(domain_id: int) -> Iterator[Observer]:
    with Observer.running(domain_id) as observer:
        yield observer


def test_nodes_start_in_any_order(tmp_path: Path, domain_id: int) -> None:
    with Nodes(paper_scenario(short(0.5)), tmp_path, domain_id) as nodes:
        for name in ("clock", "follower_2", "controller", "leader"):
            nodes.start(name)
        time.sleep(2.0)  # the others are waiting by then
        assert all(process.poll() is None for process in nodes.processes.values())
        nodes.start("follower_1")
        for name in nodes.processes:
            code, errors = nodes.end(name)
            assert code == 0
            assert all(": still waiting for " in line for line in errors.splitlines())


def test_missing_node_is_named(tmp_path: Path, domain_id: int, observer: Observer) -> None:
    who_come = (vehicle_node("leader"), vehicle_node("follower_1"), CONTROLLER_NODE)
    joined = [observer.collect(StepDone, step_done_topic(name), LATCHED) for name in who_come]
    with Nodes(paper_scenario(short(0.5)), tmp_path, domain_id) as nodes:
        for name in ("leader", "follower_1", "controller"):
            nodes.start(name)
        observer.until(lambda: all(joined))
        nodes.start("clock", "start_timeout_s:=7.0")
        code, errors = nodes.end("clock")
    assert code == EXIT_SILENT
    assert errors == (
        "/sim/clock: still waiting for /follower_2/quadrotor\n"
        "/sim/clock: not ready within 7 s: /follower_2/quadrotor\n"
    )


def test_the_controller_starts_by_its_former_name_with_a_warning() -> None:
    leader = INSTALL / "relform_controller/lib/relform_controller/leader"
    run = subprocess.run([leader], capture_output=True, text=True)
    warning, error = run.stderr.splitlines()
    assert warning == (
        "leader: warning: this executable is now called controller: ros2 run relform_controller controller"
    )
    assert error.startswith("/formation/controller: parameter scenario is not set")
    assert run.returncode == EXIT_ERROR


@pytest.mark.parametrize("name", ["follower_1", "clock"])
def test_node_of_the_same_name_elsewhere_is_named(
    name: str, tmp_path: Path, domain_id: int, observer: Observer
) -> None:
    scenario, other = paper_scenario(short(0.5)), tmp_path / "other"
    other.mkdir()
    full_name = "/sim/clock" if name == "clock" else vehicle_node(name)
    with Nodes(scenario, other, domain_id) as left_over, Nodes(scenario, tmp_path, domain_id) as nodes:
        left_over.start(name)
        observer.until(lambda: full_name in observer.nodes)
        for each in (*VEHICLES, "controller", "clock"):
            nodes.start(each)
        code, errors = nodes.end("clock")
    assert code == EXIT_ERROR
    assert errors.endswith(
        f"/sim/clock: more than one node is called {full_name}: "
        "stop the nodes that do not belong to this flight\n"
    )


def test_another_clock_is_named(tmp_path: Path, domain_id: int, observer: Observer) -> None:
    observer.node.create_publisher(Clock, "/clock", LOCKSTEP)
    with Nodes(paper_scenario(short(0.5)), tmp_path, domain_id) as nodes:
        for each in (*VEHICLES, "controller", "clock"):
            nodes.start(each)
        code, errors = nodes.end("clock")
    assert code == EXIT_ERROR
    assert f"{observer.node.get_fully_qualified_name()} publishes /clock as well" in errors


@pytest.mark.parametrize("name", ["follower_1", "controller"])
def test_silent_node_is_named_in_time(name: str, tmp_path: Path, domain_id: int, observer: Observer) -> None:
    """The other nodes wait for it and are late too, but only the silent node is named; all nodes end."""
    ticks = observer.collect(StepDone, f"{vehicle_node('leader')}/step_done", LATCHED)
    with Nodes(paper_scenario(short(20.0), "lockstep.step_timeout_s=1.5"), tmp_path, domain_id) as nodes:
        for each in (*VEHICLES, "controller", "clock"):
            nodes.start(each)
        observer.until(lambda: len(ticks) > 20)
        nodes.processes[name].send_signal(signal.SIGSTOP)
        stopped = time.monotonic()
        code, errors = nodes.end("clock")
        took = time.monotonic() - stopped
        for other in set(nodes.processes) - {name, "clock"}:
            code_of_other, last_words = nodes.end(other)
            assert code_of_other == EXIT_ERROR
            assert re.search(r": /sim/clock has gone in step \d+ \(.* s\): the flight is over\n$", last_words)
    assert code == EXIT_SILENT
    full_name = "/formation/controller" if name == "controller" else vehicle_node(name)
    last_line = errors.splitlines()[-1]
    assert last_line.startswith("/sim/clock: step ")
    assert last_line.endswith(f" not finished within 1.5 s (lockstep.step_timeout_s): {full_name}")
    assert took > 1.5


@pytest.mark.parametrize("signum", [signal.SIGINT, signal.SIGTERM])
def test_signals_end_every_node(signum: int, tmp_path: Path, domain_id: int, observer: Observer) -> None:
    ticks = observer.collect(StepDone, f"{vehicle_node('leader')}/step_done", LATCHED)
    with Nodes(paper_scenario(short(20.0)), tmp_path, domain_id) as nodes:
        for name in (*VEHICLES, "controller", "clock"):
            nodes.start(name)
        observer.until(lambda: len(ticks) > 5)
        for process in nodes.processes.values():
            process.send_signal(signum)
        ends = nodes.ends()
    assert set(ends.values()) == {(EXIT_INTERRUPTED, "")}


def formation(**positions: tuple[float, float, float]) -> list[RelativePosition]:
    return [
        RelativePosition(observer_id="leader", target_id=name, position=Vector3(x=x, y=y, z=z))
        for name, (x, y, z) in positions.items()
    ]


@pytest.mark.parametrize(
    ("request_", "says"),
    [
        (formation(follower_1=(-1.5, -0.5, 0.25)), "follower_2"),
        (formation(follower_1=(-1.5, -0.5, 0.25), follower_2=(-1.5, -0.5, 0.3)), "apart"),
        (formation(follower_1=(-1.5, -0.5, 0.25), ufo=(-1.5, 0.5, 0.3)), "ufo"),
        (formation(follower_1=(float("nan"), -0.5, 0.25), follower_2=(-1.5, 0.5, 0.3)), "must be finite"),
        (
            formation(follower_1=(-1.5, -0.5, 0.25), follower_2=(-1.5, 0.5, 0.3)) * 2,
            "'follower_1' is named twice",
        ),
        (
            [RelativePosition(observer_id="follower_2", target_id="follower_1")],
            "observer_id must be the leader 'leader' (got 'follower_2')",
        ),
    ],
    ids=["incomplete", "too near", "unknown", "nan", "twice", "observer"],
)
def test_impossible_formations_are_refused(
    request_: list[RelativePosition], says: str, flying: Observer
) -> None:
    answer = ask(flying, request_)
    assert not answer.success
    assert says in answer.message
    assert "\n" not in answer.message


@pytest.fixture(scope="module")
def flying(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Observer]:
    """An observer of a long flight."""
    folder = tmp_path_factory.mktemp("flying")
    with domain_coordinator.domain_id() as domain, Observer.running(domain) as observer:
        ticks = observer.collect(StepDone, f"{vehicle_node('leader')}/step_done", LATCHED)
        with Nodes(paper_scenario(short(600.0)), folder, domain) as nodes:
            for name in (*VEHICLES, "controller", "clock"):
                nodes.start(name)
            observer.until(lambda: len(ticks) > 5)
            yield observer


def ask(observer: Observer, request: list[RelativePosition]) -> SetFormation.Response:
    service = "/formation/set_formation"
    answer: SetFormation.Response = observer.call(
        SetFormation, service, SetFormation.Request(formation=request)
    )
    return answer


def test_a_formation_is_flown_from_the_next_step_on(flying: Observer) -> None:
    references = flying.collect(FormationReference, REFERENCE)
    events = flying.collect(FormationEvent, EVENTS, LATCHED)
    flying.until(lambda: len(references) > 2)
    answer = ask(flying, formation(follower_1=(-1.25, -0.75, 0.25), follower_2=(-1.5, 0.5, -0.5)))
    assert answer.success, answer.message
    flying.until(lambda: any(event.kind == FormationEvent.SET_FORMATION for event in events))
    event = next(event for event in events if event.kind == FormationEvent.SET_FORMATION)
    assert answer.message == f"applies from step {event.step} on, takes 2.2 s"
    assert [pair.target_id for pair in event.formation] == ["follower_1", "follower_2"]
    flying.until(lambda: references[-1].step > event.step + 1)

    def target(reference: FormationReference) -> tuple[float, float, float]:
        position = {(pair.observer_id, pair.target_id): pair.position for pair in reference.formation}[
            "leader", "follower_1"
        ]
        return (position.x, position.y, position.z)

    for reference in references:
        expected = (-1.0, -0.5, -0.5) if reference.step < event.step else (-1.25, -0.75, 0.25)
        assert target(reference) == expected, reference.step


def test_foreign_messages_change_nothing(tmp_path: Path, domain_id: int, observer: Observer) -> None:
    """A foreign node sends bad messages and floods topics; the commands stay equal, bit for bit."""
    scenario = paper_scenario(short(3.0), seed=4)
    expected = fly_in_process(scenario)
    commands = observer.collect(RotorSpeeds, "/follower_1/rotor_speeds")
    reports = observer.collect(DiagnosticArray, DIAGNOSTICS)
    ticks = observer.collect(StepDone, f"{vehicle_node('leader')}/step_done", LATCHED)
    imus = observer.node.create_publisher(Imu, "/follower_1/imu", LOCKSTEP)
    truths = observer.node.create_publisher(Odometry, "/follower_2/ground_truth", LOCKSTEP)
    dones = observer.node.create_publisher(StepDone, f"{vehicle_node('leader')}/step_done", LATCHED)

    def imu(step: int, frame: str = "follower_1/base_link", w: float = 1.0) -> Imu:
        message = Imu()
        message.header.stamp = stamp_to_msg(step * scenario.config.period_ns)
        message.header.frame_id = frame
        message.orientation.w = w
        return message

    with Nodes(scenario, tmp_path, domain_id, observers=(RECORDER_NODE,)) as nodes:
        nodes.start("recorder", f"output:={tmp_path / 'bag'}")
        for name in (*VEHICLES, "controller", "clock"):
            nodes.start(name)
        for step in range(4, scenario.config.n_steps - 4, 4):
            # Not the last one: the observer hears itself, too.
            observer.until(lambda step=step: any(tick.step >= step for tick in ticks))
            for _ in range(FLOOD):
                imus.publish(imu(step - 2))
                imus.publish(b"no message")
                truths.publish(b"")
                truths.publish(serialize_message(Odometry())[:40])
                dones.publish(ticks[-1])
            imus.publish(imu(step, w=float("nan")))
            imus.publish(imu(step, frame="ufo/base_link"))
            imus.publish(imu(step - 1))
            imus.publish(imu(step + 1000))
            truths.publish(Odometry())
            dones.publish(StepDone(step=step, node="/ufo/quadrotor"))
            dones.publish(StepDone(step=1, node="/leader/quadrotor"))
        assert nodes.ends() == dict.fromkeys(nodes.processes, (0, ""))
    last_ns = (scenario.config.n_steps - 1) * scenario.config.period_ns
    observer.until(lambda: bool(commands) and stamp_from_msg(commands[-1].header.stamp) == last_ns)

    recorded = read_flight_log(tmp_path / "bag")
    np.testing.assert_array_equal(recorded.rotor_speeds, expected.rotor_speeds)
    np.testing.assert_array_equal(recorded.p_NB_N, expected.p_NB_N)

    # The observer is no member of the barrier: on a busy machine it may be discovered after the first steps.
    steps = [stamp_from_msg(command.header.stamp) // scenario.config.period_ns for command in commands]
    assert len(steps) > scenario.config.n_steps // 2
    flown = np.array([command.speeds for command in commands])
    np.testing.assert_array_equal(flown, expected.rotor_speeds[steps, VEHICLES.index("follower_1")])

    status = {status.name: status for report in reports for status in report.status}
    counts = {name: {entry.key: entry.value for entry in each.values} for name, each in status.items()}
    controller = counts["/formation/controller"]
    assert int(controller["rejected.invalid"]) > 0
    assert int(controller["rejected.foreign"]) > 0
    assert int(controller["rejected.early"]) > 0
    assert int(controller["rejected.stale"]) + int(controller["rejected.duplicate"]) > 2 * FLOOD
    assert int(counts["/follower_1/quadrotor"]["rejected.foreign"]) > 0  # a ground truth without a frame
    assert int(counts["/follower_1/quadrotor"]["rejected.invalid"]) > 0  # one that is cut off
    assert int(counts["/sim/clock"]["rejected.stale"]) > 0
    assert counts["/follower_1/quadrotor"]["missing"] == "0"
    assert status["/formation/controller"].message.startswith("rejected ")
    assert status["/formation/controller"].level == DiagnosticStatus.WARN
