"""Real time of one controller, among nodes that the test drives by hand."""

import time
from collections.abc import Callable, Iterator

import pytest
from rclpy.node import Node
from rosgraph_msgs.msg import Clock

from relform_core.errors import FlightError
from relform_core.names import (
    CLOCK,
    CLOCK_NODE,
    CONTROLLER_NODE,
    MEMBERS,
    step_done_topic,
    vehicle_node,
)
from relform_core.roster import Roster
from relform_core.sensors.sonar import Sonar
from relform_ros.endpoints import Endpoints
from relform_ros.fields import stamp_to_msg
from relform_ros.lockstep import Done
from relform_ros.make_pacing import make_pacing
from relform_ros.member_changes import change_to_msg
from relform_ros.membership import MemberChange, Verdict
from relform_ros.sensors import sonar as sonar_wire
from relform_ros.spinner import Spinner
from relform_ros.step_done import done_to_msg
from relform_ros.topics import topic_table
from support.ros_nodes import node_maker
from support.scenarios import paper_scenario

SCENARIO = paper_scenario("pacing=real_time")
CONFIG = SCENARIO.config
ROSTER = Roster.of(CONFIG)
VEHICLES = CONFIG.team.vehicles
PERIOD_NS = CONFIG.period_ns
PERIOD = CONFIG.controller.period
SONAR = "/leader/sonar"
OWN, OTHER = 4711, 815
"""Numbers of the process of the controller, and of another one of its name."""


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
        self.pacing = make_pacing(node, self.spinner, SCENARIO, ROSTER)
        self.pacing.read(SONAR, lambda msg: sonar_wire.from_msg(msg, "leader", VEHICLES))
        self.steps = self.pacing.steps()
        deadline = time.monotonic() + 30.0
        for name, topic in (
            (CLOCK_NODE, CLOCK),
            *((n, step_done_topic(n)) for n in map(vehicle_node, VEHICLES)),
        ):
            while self._others[name].unmatched([topic]):
                assert time.monotonic() < deadline
                time.sleep(0.01)

    def tick(self, step: int) -> None:
        self._others[CLOCK_NODE].publish(CLOCK, Clock(clock=stamp_to_msg(step * PERIOD_NS)))

    def finish(self, step: int, *vehicles: str) -> None:
        """Vehicles finish a step; the leader sends its sonar measurement before."""
        for vehicle in vehicles:
            node, sent = vehicle_node(vehicle), ()
            if vehicle == "leader":
                sent = ((SONAR, step * PERIOD_NS),)
                message = sonar_wire.to_msg(Sonar(step * PERIOD_NS, 2.5, 0.25, 10.0, 0.5), vehicle)
                self._others[node].publish(SONAR, message)
            done = Done(node, step, sent, "")
            self._others[node].publish(step_done_topic(node), done_to_msg(done, step * PERIOD_NS))

    def decide(self, verdict: Verdict, process: int) -> None:
        """The clock decides on a process of the controller."""
        change = MemberChange(5, verdict, CONTROLLER_NODE, process, "the test says so")
        self._others[CLOCK_NODE].publish(MEMBERS, change_to_msg(change, 5 * PERIOD_NS))

    async def next(self) -> tuple[int, list[int]]:
        """The next step of the controller, and the steps of the measurements that it gathers there."""
        step = await anext(self.steps)
        messages = (await self.pacing.gather(step)).messages
        self.pacing.done(step)
        return step, [message.stamp_ns // PERIOD_NS for message in messages.get(SONAR, ())]


@pytest.fixture
def flight(monkeypatch: pytest.MonkeyPatch) -> Iterator[Flight]:
    monkeypatch.setattr("relform_ros.flight_pacing.secrets.randbits", lambda bits: OWN)
    with node_maker() as make:
        flight = Flight(make)
        yield flight
        flight.spinner.close()


def test_a_controller_waits_for_measurements_until_its_deadline_only(flight: Flight) -> None:
    steps = []

    async def controller() -> None:
        flight.tick(0)
        flight.finish(0, *VEHICLES)
        steps.append(await flight.next())
        flight.tick(1)
        steps.append(await flight.next())
        flight.finish(1, "leader")  # too late for step 1, and the others never finish it
        flight.tick(2)
        flight.finish(2, *VEHICLES)
        steps.append(await flight.next())

    flight.spinner.run([controller()])
    assert steps == [(0, [0]), (1, []), (2, [1, 2])]


def test_a_controller_that_is_late_hears_all_and_goes_on_to_the_newest_step(flight: Flight) -> None:
    steps = []

    async def controller() -> None:
        flight.tick(0)
        flight.finish(0, *VEHICLES)
        steps.append(await flight.next())
        for step in (1, 2, 3):
            flight.tick(step)
            flight.finish(step, *VEHICLES)
        time.sleep(10 * PERIOD)  # it is busy with something else, until long after its deadline
        steps.append(await flight.next())

    flight.spinner.run([controller()])
    assert steps == [(0, [0]), (3, [1, 2, 3])]


def test_a_controller_that_is_admitted_to_a_running_flight_begins_with_the_present_step(
    flight: Flight,
) -> None:
    steps = []

    async def controller() -> None:
        flight.decide(Verdict.ADMITTED, OTHER)  # before it was started
        flight.tick(7)
        flight.finish(7, *VEHICLES)
        flight.decide(Verdict.ADMITTED, OWN)
        steps.append(await flight.next())

    flight.spinner.run([controller()])
    assert steps == [(7, [7])]
    assert flight.pacing.joined_late


def test_a_controller_that_is_refused_ends_with_the_reason(flight: Flight) -> None:
    async def controller() -> None:
        flight.tick(7)
        flight.decide(Verdict.REFUSED, OWN)
        await flight.next()

    with pytest.raises(FlightError, match=r"^refused in step 5: the test says so$"):
        flight.spinner.run([controller()])


def test_a_controller_that_was_stopped_ends_when_another_one_was_admitted(flight: Flight) -> None:
    async def controller() -> None:
        flight.tick(0)
        flight.finish(0, *VEHICLES)
        await flight.next()
        flight.decide(Verdict.REFUSED, OTHER)
        flight.tick(1)
        flight.finish(1, *VEHICLES)
        assert await flight.next() == (1, [1])
        flight.decide(Verdict.ADMITTED, OTHER)
        await flight.next()

    message = r"^another process is /formation/controller since step 5: the test says so$"
    with pytest.raises(FlightError, match=message):
        flight.spinner.run([controller()])
