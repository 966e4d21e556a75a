"""Which requests the view offers, by the services of the nodes that run."""

from relform_live.nodes.services import offer_of
from relform_live.requests import Command, Offer


def test_offers_what_runs_in_the_order_of_a_flight() -> None:
    trigger = ["std_srvs/srv/Trigger"]
    services = {
        "/formation/controller/land": trigger,
        "/formation/controller/wave": trigger,
        "/formation/controller/take_off": trigger,
        "/formation/controller/get_parameters": ["rcl_interfaces/srv/GetParameters"],
        "/formation/set_formation": ["relform_msgs/srv/SetFormation"],
        "/elsewhere/start": trigger,
    }
    offer = offer_of(services)
    assert [command.title for command in offer.commands] == ["take off", "land", "wave"]
    assert (offer.formation, offer.go_to) == (True, False)
    assert offer.commands[0] == Command("/formation/controller/take_off")


def test_offers_nothing_without_a_flight() -> None:
    assert offer_of({}) == Offer()
