"""The table of topics is consistent, for one controller and for several."""

import pytest

from relform_core.names import CLOCK, CLOCK_NODE, MONITOR_NODE, step_done_topic, vehicle_node, vehicle_topic
from relform_core.roster import Controller, Roster
from relform_msgs.msg import FormationState, RotorSpeeds, StepDone
from relform_ros.topics import Topic, topic_table
from support.scenarios import paper_scenario

CONFIG = paper_scenario().config
VEHICLES = CONFIG.team.vehicles
RECORDER = "/recorder"
OBSERVERS = (RECORDER, MONITOR_NODE)
ROSTERS = {
    "one for all": Roster.of(CONFIG, OBSERVERS),
    "two teams": Roster(
        VEHICLES, (Controller("north", VEHICLES[:2]), Controller("south", VEHICLES[2:])), OBSERVERS
    ),
    "one each": Roster(
        VEHICLES, tuple(Controller(f"{name}_control", (name,)) for name in VEHICLES), OBSERVERS
    ),
}


@pytest.fixture(params=ROSTERS.values(), ids=ROSTERS)
def roster(request: pytest.FixtureRequest) -> Roster:
    roster: Roster = request.param
    return roster


@pytest.fixture
def table(roster: Roster) -> dict[str, Topic]:
    return topic_table(CONFIG, roster)


def test_only_nodes_of_the_flight_write_and_read(roster: Roster, table: dict[str, Topic]) -> None:
    known = {CLOCK_NODE, *roster.members}
    for topic in table.values():
        assert topic.writers
        assert set(topic.writers) <= known
        assert set(topic.readers) <= known
        assert len(set(topic.readers)) == len(topic.readers)


def test_each_vehicle_is_commanded_by_one_controller(roster: Roster, table: dict[str, Topic]) -> None:
    commands = [topic for topic in table.values() if topic.type is RotorSpeeds]
    assert [topic.name for topic in commands] == [f"/{name}/rotor_speeds" for name in VEHICLES]
    for vehicle, topic in zip(VEHICLES, commands, strict=True):
        assert topic.writers == (roster.commander(vehicle).node,)
        assert topic.readers == (vehicle_node(vehicle), *OBSERVERS)


def test_only_its_commander_and_the_recorder_read_the_sensors_of_a_vehicle(
    roster: Roster, table: dict[str, Topic]
) -> None:
    for vehicle in VEHICLES:
        for sensor in CONFIG.sensors_of(vehicle):
            readers = table[vehicle_topic(vehicle, sensor.name)].readers
            assert readers == (roster.commander(vehicle).node, RECORDER)


def test_each_controller_has_its_own_telemetry(roster: Roster, table: dict[str, Topic]) -> None:
    for controller in roster.controllers:
        for name in (controller.state, controller.solver, controller.reference):
            assert table[name].writers == (controller.node,)
        vehicles = tuple(map(vehicle_node, controller.vehicles))
        assert table[controller.events].writers == (*vehicles, controller.node)
    assert len([topic for topic in table.values() if topic.type is FormationState]) == len(roster.controllers)


def test_the_clock_and_those_that_wait_for_a_node_read_its_step_done(
    roster: Roster, table: dict[str, Topic]
) -> None:
    assert table[CLOCK].readers == roster.members
    for node in roster.members:
        assert table[step_done_topic(node)].type is StepDone
        assert table[step_done_topic(node)].readers[0] == CLOCK_NODE
    for vehicle in VEHICLES:
        node, commander = vehicle_node(vehicle), roster.commander(vehicle).node
        assert set(table[step_done_topic(node)].readers) == {CLOCK_NODE, commander, *OBSERVERS}
        assert node in table[step_done_topic(commander)].readers
