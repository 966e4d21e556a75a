"""Over links that lose, delay and reorder messages, a flight over ROS is that in one process, bit for bit."""

from collections.abc import Iterator
from pathlib import Path

import domain_coordinator
import numpy as np
import pytest

from relform_analysis.flight.from_bag import read_flight_log
from relform_analysis.flight.simulate import SimulatedStep, fly_in_process, simulate
from relform_analysis.replay.from_bag import read_recorded_flight
from relform_analysis.replay.replay import RecordedFlight, replay
from relform_controller.blas import one_blas_thread
from relform_core.names import RECORDER_NODE
from relform_core.sensors.applied_rotor_speeds import APPLIED_ROTOR_SPEEDS
from relform_core.sensors.imu import IMU
from support.nodes import Nodes, short
from support.scenarios import paper_scenario

LEAD_STEPS = 3
"""More than what a message may be ahead of its step without a known delay."""
SCENARIO = paper_scenario(
    short(1.5),
    "controller.estimator=team",
    "links={up: {loss_probability: 0.1, delay_s: 0.01, jitter_s: 0.12}, "
    "down: {loss_probability: 0.1, burst_s: 0.1, burst_interval_s: 0.6, delay_s: 0.02, jitter_s: 0.12}}",
    "events=[{kind: link, target: leader, start_s: 0.7, end_s: 1.0, delay_s: 0.06, loss_probability: 0.1}]",
    seed=3,
)
STEPS = SCENARIO.config.n_steps
VEHICLES = SCENARIO.config.team.vehicles


@pytest.fixture(scope="module")
def domain_id() -> Iterator[int]:
    with domain_coordinator.domain_id() as domain:
        yield domain


@pytest.fixture(scope="module")
def bag(domain_id: int, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("links")
    with Nodes(SCENARIO, folder, domain_id, observers=[RECORDER_NODE]) as nodes:
        for vehicle in VEHICLES:
            nodes.start(vehicle)
        nodes.start("controller")
        nodes.start("recorder", f"output:={folder / 'bag'}")
        nodes.start("clock")
        for name in nodes.processes:
            code, errors = nodes.end(name)
            assert code == 0, errors
    return folder / "bag"


@pytest.fixture(scope="module")
def recorded(bag: Path) -> RecordedFlight:
    return read_recorded_flight(bag)


@pytest.fixture(scope="module")
def in_process() -> list[SimulatedStep]:
    with one_blas_thread():
        return list(simulate(SCENARIO))


def test_the_links_do_what_this_test_is_about(in_process: list[SimulatedStep]) -> None:
    assert SCENARIO.config.command_lead_steps == LEAD_STEPS
    ages: list[int] = []
    for step in in_process:
        arrived = step.measurements.by_vehicle["follower_1"].arrived(IMU)
        ages += [step.measurements.arrival_ns - each.stamp_ns for each in arrived]
    assert len(ages) < STEPS  # some were lost
    assert len(set(ages)) == 3


def test_measurements_arrive_in_the_same_steps(
    recorded: RecordedFlight, in_process: list[SimulatedStep]
) -> None:
    assert len(recorded.steps) == STEPS
    for step, expected in zip(recorded.steps, in_process[:-1], strict=True):
        for vehicle in VEHICLES:
            found = step.measurements.by_vehicle[vehicle]
            wanted = expected.measurements.by_vehicle[vehicle]
            assert {
                name: [each.stamp_ns for each in arrived] for name, arrived in found.by_sensor.items()
            } == {name: [each.stamp_ns for each in arrived] for name, arrived in wanted.by_sensor.items()}
            for report, applied in zip(
                found.arrived(APPLIED_ROTOR_SPEEDS), wanted.arrived(APPLIED_ROTOR_SPEEDS), strict=True
            ):
                np.testing.assert_array_equal(report.speeds, applied.speeds)


def test_commands_are_the_same(recorded: RecordedFlight, in_process: list[SimulatedStep]) -> None:
    for number, (step, expected) in enumerate(zip(recorded.steps, in_process[:-1], strict=True)):
        decided = {} if expected.decision is None else expected.decision.commands
        assert step.commands.keys() == decided.keys()
        for vehicle, command in decided.items():
            found = step.commands[vehicle]
            assert found.stamp_ns == command.stamp_ns == (number + LEAD_STEPS) * SCENARIO.config.period_ns
            np.testing.assert_array_equal(found.speeds, command.speeds)
            np.testing.assert_array_equal(found.predicted_speeds, command.predicted_speeds)


def test_the_recording_is_replayed_with_its_delays(recorded: RecordedFlight) -> None:
    assert replay(recorded, recorded.scenario).identical


def test_the_log_of_the_bag_is_that_of_the_flight_in_one_process(bag: Path) -> None:
    found, expected = read_flight_log(bag), fly_in_process(SCENARIO)
    for name in ("tick_ns", "p_NB_N", "tick_of_step", "rotor_speeds", "p_BB_C__est"):
        np.testing.assert_array_equal(getattr(found, name), getattr(expected, name))
    assert np.isfinite(found.rotor_speeds).all()
