"""Lock-step of one node, among nodes that the test drives by hand."""

import time
from collections.abc import Callable, Iterator

import pytest
from rclpy.node import Node
from rosgraph_msgs.msg import Clock

from relform_core.names import (
    CLOCK,
    CLOCK_NODE,
    CONTROLLER_NODE,
    step_done_topic,
    vehicle_node,
)
from relform_core.roster import Roster
from relform_core.sensors.sonar import Sonar
from relform_ros.endpoints import Endpoints
from relform_ros.fields import stamp_to_msg
from relform_ros.lockstep import Done
from relform_ros.lockstep_pacing import LockstepPacing
from relform_ros.sensors import sonar as sonar_wire
from relform_ros.spinner import Spinner
from relform_ros.step_done import done_to_msg
from relform_ros.topics import topic_table
from support.ros_nodes import node_maker
from support.scenarios import paper_scenario

SCENARIO = paper_scenario()
CONFIG = SCENARIO.config
ROSTER = Roster.of(CONFIG)
VEHICLES = CONFIG.team.vehicles
PERIOD_NS = CONFIG.period_ns
SONAR = "/leader/sonar"


class Flight:
    """The pacing of a controller; clock and vehicles do what the test says."""

    def __init__(self, make_node: Callable[[str], Node]) -> None:
        table = topic_table(CONFIG, ROSTER)
        self._others = {}
        for full_name in (CLOCK_NODE, *map(vehicle_node, VEHICLES)):
            endpoints = self._others[full_name] = Endpoints(make_node(full_name), table)
            for topic in endpoints.readable:
                endpoints.subscribe(topic.name, lambda message: None)
        node = make_node(CONTROLLER_NODE)
        self.spinner = Spinner(node)
        self.pacing = LockstepPacing(node, self.spinner, SCENARIO, ROSTER)
        self.pacing.read(SONAR, lambda msg: sonar_wire.from_msg(msg, "leader", VEHICLES))
        self.steps = self.pacing.steps()

    def connect(self) -> None:
        """Wait until the vehicles have found the controller: what they publish now arrives."""
        deadline = time.monotonic() + 30.0
        for name in map(vehicle_node, VEHICLES):
            while self._others[name].unmatched([step_done_topic(name)]):
                assert time.monotonic() < deadline
                time.sleep(0.01)
        while self._others[CLOCK_NODE].unmatched([CLOCK]):
            assert time.monotonic() < deadline
            time.sleep(0.01)

    def step(self, step: int, sonar_ns: tuple[int, ...]) -> None:
        """The clock ticks, the leader sends sonar measurements of these stamps, all vehicles are done."""
        self._others[CLOCK_NODE].publish(CLOCK, Clock(clock=stamp_to_msg(step * PERIOD_NS)))
        for vehicle in VEHICLES:
            node = vehicle_node(vehicle)
            stamps_ns = sonar_ns if vehicle == "leader" else ()
            for stamp_ns in stamps_ns:
                message = sonar_wire.to_msg(Sonar(stamp_ns, 2.5, 0.25, 10.0, 0.5), vehicle)
                self._others[node].publish(SONAR, message)
            done = Done(node, step, tuple((SONAR, stamp_ns) for stamp_ns in stamps_ns), "")
            self._others[node].publish(step_done_topic(node), done_to_msg(done, step * PERIOD_NS))


@pytest.fixture
def flight() -> Iterator[Flight]:
    with node_maker() as make:
        flight = Flight(make)
        yield flight
        flight.spinner.close()


def test_a_delayed_measurement_is_gathered_in_the_step_in_which_it_arrives(flight: Flight) -> None:
    gathered = []

    async def controller() -> None:
        for step, sonar_ns in enumerate([(0,), (), (PERIOD_NS, 2 * PERIOD_NS), (3 * PERIOD_NS,)]):
            flight.step(step, sonar_ns)
            assert await anext(flight.steps) == step
            messages = (await flight.pacing.gather(step)).messages
            gathered.append([message.stamp_ns // PERIOD_NS for message in messages.get(SONAR, ())])
            flight.pacing.done(step)

    flight.connect()
    flight.spinner.run([controller()])
    assert gathered == [[0], [], [1, 2], [3]]
