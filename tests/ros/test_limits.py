"""Limits in flight over ROS: what the controller says of them, and that such a flight can be repeated."""

from pathlib import Path

import domain_coordinator
import numpy as np
import pytest

from relform_analysis.flight.from_bag import read_flight_log
from relform_analysis.flight.log import FlightLog
from relform_analysis.flight.simulate import SimulatedStep, simulate
from relform_analysis.replay.from_bag import read_recorded_flight
from relform_analysis.replay.replay import replay
from relform_bags.from_bag import decode
from relform_bags.reader import BagMessage, read_bag
from relform_controller.blas import one_blas_thread
from relform_core.load import load_scenario
from relform_core.names import DIAGNOSTICS, RECORDER_NODE, SeparationLevel
from support.nodes import Nodes

SCENARIO = load_scenario(
    "gust",
    [
        "controller=retuned",
        "controller.constraints={}",
        "phases.0.duration_s=3.0",
        "phases.0.steady_from_s=2.5",
        "separation={}",
        "geofence={x_m: [-3, 9], y_m: [-2, 2], height_max_m: 2.6}",
        "events=[{kind: wind, target: follower_1, start_s: 1.0, end_s: 2.0, force_n: [0, 3, 0]}, "
        "{kind: wind, target: follower_2, start_s: 1.0, end_s: 2.0, force_n: [0, -3, 0]}, "
        "{kind: wind, target: leader, start_s: 1.0, end_s: 2.0, force_n: [0, 0, 6]}]",
    ],
    5,
)
"""Gusts drive two followers together, and the leader up."""
SEPARATION = "/formation/separation"


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("limits")
    with (
        domain_coordinator.domain_id() as domain,
        Nodes(SCENARIO, folder, domain, observers=[RECORDER_NODE]) as nodes,
    ):
        nodes.start("composed", f"output:={folder / 'bag'}")  # with the recorder
        code, errors = nodes.end("composed")
    assert code == 0, errors
    assert "/formation/controller: separation: follower_1 and follower_2 are 0.6" in errors
    assert "/formation/controller: leader: is outside the geofence: z = 2.6" in errors
    return folder / "bag"


@pytest.fixture(scope="module")
def flown(bag: Path) -> FlightLog:
    return read_flight_log(bag)


@pytest.fixture(scope="module")
def in_process() -> list[SimulatedStep]:
    with one_blas_thread():
        return list(simulate(SCENARIO))


def test_it_is_the_flight_in_one_process(flown: FlightLog, in_process: list[SimulatedStep]) -> None:
    p_NB_N = [[truth.p_NB_N for truth in step.ground_truth.values()] for step in in_process]
    np.testing.assert_array_equal(flown.p_NB_N, p_NB_N)
    alarms = [alarm for step in in_process if step.decision for alarm in step.decision.alarms]
    assert [(each.source, each.description) for each in flown.alarms] == [
        (alarm.source, alarm.description) for alarm in alarms
    ]
    assert {alarm.source for alarm in alarms} == {"separation", "leader"}


def test_a_replay_decides_the_same(bag: Path) -> None:
    recorded = read_recorded_flight(bag)
    assert replay(recorded, recorded.scenario).identical


def test_separation_is_published_in_every_step(bag: Path, in_process: list[SimulatedStep]) -> None:
    messages = [decode(each) for each in read_bag(bag, {SEPARATION}) if isinstance(each, BagMessage)]
    reports = [step.decision.separation for step in in_process if step.decision is not None]
    assert len(messages) == len(reports) == SCENARIO.config.n_steps
    for message, report in zip(messages, reports, strict=True):
        assert report is not None
        assert message.level == report.level
        assert tuple(message.nearest) == report.estimated.vehicles
        assert message.distance == report.estimated.distance
        assert message.predicted_distance == report.predicted.distance
        assert report.measured is not None
        assert message.measured_distance == report.measured.distance
    levels = [message.level for message in messages]
    assert levels[10] == SeparationLevel.OK
    assert SeparationLevel.EMERGENCY in levels


def test_diagnostics_say_it(bag: Path) -> None:
    said: dict[str, str] = {}
    for each in read_bag(bag, {DIAGNOSTICS}):
        if isinstance(each, BagMessage):
            for status in decode(each).status:
                said[status.name] = f"{said.get(status.name, '')} {status.message}"
    assert "geofence: leader is outside the geofence" in said["/formation/controller"]
    assert "intervals in which another vehicle was too close: " in said["/follower_1/quadrotor"]
    assert "intervals above the geofence: " in said["/leader/quadrotor"]
