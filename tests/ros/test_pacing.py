"""Nodes do not know how their steps are paced: they fly a script as they fly in lock-step."""

from collections.abc import AsyncIterator, Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any

import pytest
from rclpy.node import Node
from rclpy.parameter import Parameter

from relform_analysis.flight.simulate import SimulatedStep, simulate
from relform_controller.blas import one_blas_thread
from relform_controller.nodes.controller import ControllerNode
from relform_core.names import CONTROLLER_NODE, vehicle_topic
from relform_core.roster import Roster
from relform_ros.commands import rotor_command_from_msg, rotor_command_to_msg
from relform_ros.odometry import odometry_to_msg
from relform_ros.pacing import Gathered, Pacing, Stamped
from relform_ros.sensors.wire import wire
from relform_ros.telemetry import reference_from_msg, state_from_msg
from relform_ros.topics import Topic
from relform_sim.nodes.quadrotor import Quadrotor
from support.nodes import short
from support.ros_nodes import node_maker, run_without_waiting
from support.scenarios import paper_scenario
from support.wire import bits

SCENARIO = paper_scenario(short(1.0), seed=4)
CONFIG = SCENARIO.config
VEHICLES = CONFIG.team.vehicles
ROSTER = Roster.of(CONFIG)
Script = Sequence[Mapping[str, Any]]


class ScriptedPacing:
    """Steps without a clock, without waiting and without other nodes: each has the messages of a script."""

    readable: tuple[Topic, ...] = ()
    joined_late = False

    def __init__(self, script: Script) -> None:
        self._script = script
        self._decoders: dict[str, Callable[[Any], Stamped]] = {}
        self.published: list[dict[str, list[Any]]] = [{} for _ in script]
        self.finished: list[int] = []
        self._step = 0

    def read(
        self,
        topic: str,
        decode: Callable[[Any], Stamped],
        raw: bool = False,
        decode_data: Callable[[bytes], Stamped] | None = None,
    ) -> None:
        assert not raw
        self._decoders[topic] = decode

    def watch(self, topic: str, take: Callable[[bytes, int], None]) -> None:
        raise AssertionError("neither vehicles nor controllers watch a topic")

    async def steps(self) -> AsyncIterator[int]:
        for step in range(len(self._script)):
            self._step = step
            yield step

    async def gather(self, step: int, topics: Iterable[str] | None = None) -> Gathered:
        messages = self._script[step]
        wanted = [topic for topic in (self._decoders if topics is None else topics) if topic in messages]
        return Gathered({topic: (self._decoders[topic](messages[topic]),) for topic in wanted}, faulty=False)

    def publish(self, topic: str, message: Any, content: Stamped | None = None) -> None:
        self.published[self._step].setdefault(topic, []).append(message)

    def done(
        self,
        step: int,
        fault: str = "",
        promised: Iterable[str] = (),
        report: Callable[[], Mapping[str, object]] = dict,
        *,
        rests: bool = False,
    ) -> None:
        assert not fault
        assert not rests
        self.finished.append(step)

    async def leave(self) -> None:
        raise AssertionError("the script is complete")


@pytest.fixture(scope="module")
def flight() -> list[SimulatedStep]:
    with one_blas_thread():
        return list(simulate(SCENARIO))


@pytest.fixture(scope="module")
def script(flight: list[SimulatedStep]) -> Script:
    """Everything that vehicles and controller publish, by step and topic."""
    return [truth_messages(step) | measurement_messages(step) | command_messages(step) for step in flight]


def truth_messages(step: SimulatedStep) -> dict[str, Any]:
    return {
        vehicle_topic(name, "ground_truth"): odometry_to_msg(truth, name)
        for name, truth in step.ground_truth.items()
    }


def measurement_messages(step: SimulatedStep) -> dict[str, Any]:
    return {
        vehicle_topic(name, sensor.name): wire(sensor).to_msg(measurement, name)
        for name, measurements in step.measurements.by_vehicle.items()
        for sensor in CONFIG.sensors_of(name)
        for measurement in measurements.arrived(sensor)
    }


def command_messages(step: SimulatedStep) -> dict[str, Any]:
    commands = {} if step.decision is None else step.decision.commands
    return {
        vehicle_topic(name, "rotor_speeds"): rotor_command_to_msg(command, name)
        for name, command in commands.items()
    }


@pytest.fixture
def make_node() -> Iterator[Callable[[str], Node]]:
    with node_maker() as make:
        yield make


@pytest.mark.parametrize("vehicle", VEHICLES)
def test_a_vehicle_flies_a_script(vehicle: str, script: Script, make_node: Callable[[str], Node]) -> None:
    scripted = ScriptedPacing(script)
    pacing: Pacing = scripted
    run_without_waiting(
        Quadrotor(make_node(f"/{vehicle}/quadrotor"), vehicle, SCENARIO, ROSTER, pacing).run()
    )
    assert scripted.finished == list(range(CONFIG.n_steps + 1))
    own = {
        vehicle_topic(vehicle, name)
        for name in ("ground_truth", *(s.name for s in CONFIG.sensors_of(vehicle)))
    }
    expected = [{topic: [step[topic]] for topic in step if topic in own} for step in script]
    assert scripted.published == expected


def test_a_controller_flies_a_script(
    flight: list[SimulatedStep], script: Script, make_node: Callable[[str], Node]
) -> None:
    (controller,) = ROSTER.controllers
    scripted = ScriptedPacing(script)
    with one_blas_thread():
        run_without_waiting(ControllerNode(make_node(CONTROLLER_NODE), SCENARIO, controller, scripted).run())
    assert scripted.finished == list(range(CONFIG.n_steps + 1))
    assert scripted.published[-1] == {}
    for step, published in zip(flight[:-1], scripted.published, strict=False):
        assert step.decision is not None
        for vehicle, command in step.decision.commands.items():
            (message,) = published[vehicle_topic(vehicle, "rotor_speeds")]
            assert bits(rotor_command_from_msg(message, vehicle)) == bits(command)
        (message,) = published[controller.state]
        assert bits(state_from_msg(message, VEHICLES).value) == bits(step.decision.state)
        assert {controller.solver, controller.reference, controller.events} < published.keys()


def test_a_request_during_the_start_wait_is_kept(script: Script, make_node: Callable[[str], Node]) -> None:
    """The controller waits for the leader's IMU when the formation is set by a parameter."""
    (controller,) = ROSTER.controllers
    without_imu = {topic: each for topic, each in script[0].items() if topic != "/leader/imu"}
    node = make_node(CONTROLLER_NODE)
    requested, parameter, shown = [-1.25, -0.75, -0.5], "formation.follower_1", []

    class Looking(ScriptedPacing):
        async def gather(self, step: int, topics: Iterable[str] | None = None) -> Gathered:
            shown.append(list(node.get_parameter(parameter).value))
            return await super().gather(step, topics)

    scripted = Looking([without_imu, *script[1:]])
    with one_blas_thread():
        logic = ControllerNode(node, SCENARIO, controller, scripted)
        (result,) = node.set_parameters([Parameter(parameter, value=requested)])
        assert result.successful
        run_without_waiting(logic.run())
    assert CONFIG.formations["initial"]["follower_1"] != tuple(requested)
    assert shown == [requested] * len(script)
    assert controller.state not in scripted.published[0]
    (reference,) = scripted.published[1][controller.reference]
    flown = reference_from_msg(reference, VEHICLES).value.formation["leader", "follower_1"]
    assert flown.tolist() == requested
