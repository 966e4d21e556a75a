"""docs/topics.md names the topics and services of a running flight, with their types, and no others."""

import re
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path

import domain_coordinator
import pytest

from support.nodes import Nodes
from support.observer import Observer
from support.scenarios import FROM_GROUND, WITH_BAROMETER, paper_scenario

PAGE = Path(__file__).parents[2] / "docs/topics.md"
EVERYTHING = paper_scenario(
    "controller=team",
    WITH_BAROMETER,
    FROM_GROUND,
    "separation={}",
    "links={up: {loss_probability: 0.01}}",
    "separation={}",
)
"""A flight with every topic that depends on the configuration."""
DISCOVERY_S = 20.0
NEVER = "/never"
"""The flight waits for this node, and meanwhile has all its topics."""
OF_EVERY_NODE = {"/rosout", "/parameter_events"}
SERVICES_OF_EVERY_NODE = ("rcl_interfaces/", "type_description_interfaces/")


def sections() -> dict[str, str]:
    parts = (part.partition("\n") for part in PAGE.read_text().split("\n## ")[1:])
    return {title: text for title, _, text in parts}


def documented() -> dict[str, str]:
    """Types by topic, with the placeholders of the page."""
    return {
        ("/<vehicle>/" if title.startswith("Per vehicle") else "") + name: type_name
        for title, text in sections().items()
        for name, type_name in re.findall(r"^\| `([^`]+)` \| (\w+_msgs/\w+) \|", text, re.MULTILINE)
        if title != "Services"
    }


def as_on_the_page(topic: str) -> str:
    """The name of a topic, with placeholders."""
    team = EVERYTHING.config.team
    _, first, *rest = topic.split("/")
    if topic.endswith("/step_done"):
        return "<node>/step_done"
    if first not in team.vehicles:
        return topic
    of_leader = "/".join(("/<leader>", *rest))
    if first == team.leader and of_leader in documented():
        return of_leader
    return "/".join(("/<vehicle>", *rest))


@pytest.fixture(scope="module")
def observer(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Observer]:
    """It watches a flight, and what is drawn of it."""
    with (
        domain_coordinator.domain_id() as domain,
        Observer.running(domain) as observer,
        Nodes(EVERYTHING, tmp_path_factory.mktemp("run"), domain, [NEVER]) as nodes,
    ):
        nodes.start("composed")
        nodes.start("visualization")
        yield observer


def discover(observer: Observer, condition: Callable[[], bool]) -> None:
    """Wait until the graph fulfils a condition; if it never does, the test that follows says why."""
    with suppress(AssertionError):
        observer.until(condition, DISCOVERY_S)


def test_topics_and_types_are_those_of_the_page(observer: Observer) -> None:
    def running() -> dict[str, str]:
        return {
            as_on_the_page(name): type_name.replace("/msg/", "/")
            for name, (type_name,) in observer.node.get_topic_names_and_types()
            if name not in OF_EVERY_NODE
        }

    discover(observer, lambda: running() == documented())
    assert running() == documented()


def test_services_are_on_the_page(observer: Observer) -> None:
    def running() -> set[str]:
        return {
            name.rpartition("/")[2]
            for name, (type_name,) in observer.node.get_service_names_and_types()
            if not type_name.startswith(SERVICES_OF_EVERY_NODE)
        }

    discover(observer, lambda: "set_formation" in running())
    assert "set_formation" in running()
    assert running() <= set(re.findall(r"\w+(?=`)", sections()["Services"]))
