"""With a delaying link, a flight over ROS is the same as in one process, bit for bit."""

import sys
from collections.abc import Iterator
from pathlib import Path

import domain_coordinator
import numpy as np
import pytest

from relform_analysis.flight.simulate import SimulatedStep, simulate
from relform_analysis.replay.from_bag import read_recorded_flight
from relform_analysis.replay.replay import RecordedFlight, replay
from relform_controller.blas import one_blas_thread
from relform_core.names import RECORDER_NODE
from support.links import DELAY_STEPS, delayed_link
from support.nodes import Nodes, short
from support.scenarios import paper_scenario

# A gentle controller, as in tests/closed_loop/test_delayed_link.py.
SCENARIO = paper_scenario(
    short(0.6),
    "controller.period_s=0.02",
    "controller.horizon_steps=30",
    "controller.weights.torque_per_n2_m2=100",
    seed=3,
)
STEPS = SCENARIO.config.n_steps
VEHICLES = SCENARIO.config.team.vehicles


@pytest.fixture(scope="module")
def domain_id() -> Iterator[int]:
    with domain_coordinator.domain_id() as domain:
        yield domain


@pytest.fixture(scope="module")
def recorded(domain_id: int, tmp_path_factory: pytest.TempPathFactory) -> RecordedFlight:
    folder = tmp_path_factory.mktemp("delayed")
    program = (sys.executable, str(Path(__file__).with_name("delayed_quadrotor.py")))
    with Nodes(SCENARIO, folder, domain_id, observers=[RECORDER_NODE], quadrotor=program) as nodes:
        for vehicle in VEHICLES:
            nodes.start(vehicle)
        nodes.start("controller")
        nodes.start("recorder", f"output:={folder / 'bag'}")
        nodes.start("clock")
        for name in nodes.processes:
            code, errors = nodes.end(name)
            assert code == 0, errors
    return read_recorded_flight(folder / "bag")


@pytest.fixture(scope="module")
def in_process() -> list[SimulatedStep]:
    with one_blas_thread():
        return list(simulate(SCENARIO, delayed_link))


def test_measurements_arrive_in_the_same_steps(
    recorded: RecordedFlight, in_process: list[SimulatedStep]
) -> None:
    assert len(recorded.steps) == STEPS
    for number, (step, expected) in enumerate(zip(recorded.steps, in_process[:-1], strict=True)):
        assert step.measurements.arrival_ns == number * SCENARIO.config.period_ns
        for vehicle in VEHICLES:
            found = step.measurements.by_vehicle[vehicle].by_sensor
            wanted = expected.measurements.by_vehicle[vehicle].by_sensor
            assert {name: [each.stamp_ns for each in arrived] for name, arrived in found.items()} == {
                name: [each.stamp_ns for each in arrived] for name, arrived in wanted.items()
            }
            assert bool(found) == (number >= DELAY_STEPS)


def test_commands_are_the_same(recorded: RecordedFlight, in_process: list[SimulatedStep]) -> None:
    for step, expected in zip(recorded.steps, in_process[:-1], strict=True):
        decided = {} if expected.decision is None else expected.decision.commands
        assert step.commands.keys() == decided.keys()
        for vehicle, command in decided.items():
            np.testing.assert_array_equal(step.commands[vehicle].speeds, command.speeds)
            np.testing.assert_array_equal(step.commands[vehicle].predicted_speeds, command.predicted_speeds)


def test_the_recording_is_replayed_with_its_delays(recorded: RecordedFlight) -> None:
    assert replay(recorded, recorded.scenario).identical
