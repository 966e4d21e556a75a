"""Which controller commands which vehicle: names are unique, and every vehicle has exactly one controller."""

import pytest

from relform_core import names
from relform_core.errors import ConfigError
from relform_core.roster import Controller, Roster
from support.scenarios import paper_scenario

VEHICLES = ("leader", "follower_1", "follower_2", "scout")
TWO_TEAMS = (Controller("north", VEHICLES[:2]), Controller("south", VEHICLES[2:]))
ONE_EACH = tuple(Controller(f"{vehicle}_control", (vehicle,)) for vehicle in VEHICLES)


def test_one_controller_commands_the_vehicles_of_a_scenario_under_the_known_names() -> None:
    roster = Roster.of(paper_scenario().config, ["/recorder"])
    (controller,) = roster.controllers
    assert controller.vehicles == roster.vehicles == ("leader", "follower_1", "follower_2")
    assert controller.node == names.CONTROLLER_NODE == "/formation/controller"
    assert (controller.state, controller.solver) == ("/formation/state", names.SOLVER)
    assert (controller.reference, controller.events) == (names.REFERENCE, names.EVENTS)
    assert roster.members[-2:] == ("/formation/controller", "/recorder")


@pytest.mark.parametrize("controllers", [TWO_TEAMS, ONE_EACH], ids=["two teams", "one each"])
def test_each_vehicle_has_one_commander_and_each_node_one_name(controllers: tuple[Controller, ...]) -> None:
    roster = Roster(VEHICLES, controllers)
    for vehicle in VEHICLES:
        assert vehicle in roster.commander(vehicle).vehicles
    assert len(set(roster.members)) == len(roster.members) == len(VEHICLES) + len(controllers)
    for controller in controllers:
        assert roster.controller_at(controller.node) is controller


@pytest.mark.parametrize(
    ("controllers", "says"),
    [
        ((TWO_TEAMS[0],), "controllers: exactly one must command 'follower_2' (got 0)"),
        ((*TWO_TEAMS, Controller("all", VEHICLES)), "controllers: exactly one must command 'leader' (got 2)"),
        ((TWO_TEAMS[0], Controller("north", VEHICLES[2:])), "the namespace 'north' is used 2 times"),
        ((TWO_TEAMS[0], Controller("leader", VEHICLES[2:])), "the namespace 'leader' is used 2 times"),
        (
            (*TWO_TEAMS, Controller("x", ("ufo",))),
            "unknown vehicle 'ufo', expected one of leader, ",
        ),
    ],
    ids=["without", "two", "same name", "name of a vehicle", "unknown"],
)
def test_inconsistent_rosters_are_refused(controllers: tuple[Controller, ...], says: str) -> None:
    with pytest.raises(ConfigError) as error:
        Roster(VEHICLES, controllers)
    assert says in str(error.value)
    assert "\n" not in str(error.value)


def test_a_node_that_is_not_a_controller_is_refused_with_the_known_names() -> None:
    with pytest.raises(ConfigError) as error:
        Roster(VEHICLES, TWO_TEAMS).controller_at("/west/controller")
    assert str(error.value) == (
        "unknown node name /west/controller, expected one of /north/controller, /south/controller"
    )
