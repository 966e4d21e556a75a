"""A flight in one process, whose nodes also get messages that no node of the flight has sent."""

from collections import defaultdict
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import rclpy
from rclpy.context import Context
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.serialization import serialize_message

from relform_controller.nodes.controller import ControllerNode
from relform_core.load import LoadedScenario
from relform_core.names import CLOCK, CLOCK_NODE, DIAGNOSTICS, SOLVER, split_node_name, vehicle_node
from relform_core.roster import Roster
from relform_ros.intra_process import IntraProcess
from relform_ros.make_pacing import make_pacing
from relform_ros.spinner import Spinner
from relform_ros.topics import topic_table
from relform_sim.nodes.clock import ClockServer
from relform_sim.nodes.quadrotor import Quadrotor
from support.wire import bits

Sent = list[tuple[str, Any]]
"""Topics and messages."""
Disturb = Callable[[str, Any, Sequence[Any]], tuple[Iterable[Any], Iterable[Any]]]
"""(topic, message, those sent before on the topic) -> (what a stranger sends before it, and after it)."""


class _LongEnough(Exception):  # noqa: N818  # it is no error
    """The part of the flight that is wanted is over."""


class Disturbed(IntraProcess):
    """Delivers what the nodes send, and what a stranger sends on the same topics, until a step is over."""

    def __init__(self, nodes: Iterable[str], disturb: Disturb, last_step: int) -> None:
        super().__init__(nodes)
        self._n_ticks = last_step + 1
        self._disturb = disturb
        self.sent: Sent = []
        """By the nodes of the flight, in order."""
        self.strange: defaultdict[str, int] = defaultdict(int)
        """Number of messages of the stranger by topic."""
        self._before: defaultdict[str, list[Any]] = defaultdict(list)

    def publish(self, topic: str, message: Any, data: bytes, content: Any = None) -> None:
        """See ``IntraProcess``."""
        if topic == CLOCK and len(self._before[topic]) == self._n_ticks:
            raise _LongEnough
        first, last = self._disturb(topic, message, self._before[topic])
        self._before[topic].append(message)
        self.sent.append((topic, message))
        self._deliver(topic, first)
        super().publish(topic, message, data, content)
        self._deliver(topic, last)

    def _deliver(self, topic: str, messages: Iterable[Any]) -> None:
        for message in messages:
            self.strange[topic] += 1
            super().publish(topic, message, serialize_message(message))


@dataclass
class Flown:
    """What the nodes of a flight have sent."""

    sent: Sent
    decisive: dict[str, list[Any]]
    """All messages but those with counts or times of the machine, in order by topic."""
    rejected: dict[str, dict[str, int]] = field(default_factory=dict)
    """Number of rejected messages by node and reason, by its last diagnostics."""
    strange: dict[str, int] = field(default_factory=dict)
    """Number of messages of the stranger that each node has got."""


def fly_disturbed(
    scenario: LoadedScenario, folder: Path, context: Context, disturb: Disturb, last_step: int
) -> Flown:
    """Fly a scenario up to a step, which should have diagnostics."""
    config = folder / "config.yaml"
    config.write_text(scenario.effective_yaml)
    roster = Roster.of(scenario.config)
    parameters = [Parameter("scenario", value=str(config))]
    names = [CLOCK_NODE, *roster.members]
    nodes: dict[str, Node] = {}
    for full_name in names:
        namespace, name = split_node_name(full_name)
        nodes[full_name] = rclpy.create_node(
            name, namespace=namespace, context=context, parameter_overrides=parameters
        )
    spinner = Spinner(*nodes.values())
    wire = spinner.intra_process = Disturbed(names, disturb, last_step)
    try:
        logics = [ClockServer(nodes[CLOCK_NODE], spinner).run()]
        for vehicle in roster.vehicles:
            node = nodes[vehicle_node(vehicle)]
            pacing = make_pacing(node, spinner, scenario, roster)
            logics.append(Quadrotor(node, vehicle, scenario, roster, pacing).run())
        for controller in roster.controllers:
            pacing = make_pacing(nodes[controller.node], spinner, scenario, roster)
            logics.append(ControllerNode(nodes[controller.node], scenario, controller, pacing).run())
        with suppress(_LongEnough):
            spinner.run(logics)
    finally:
        spinner.close()
        for node in nodes.values():
            node.destroy_node()
    readers = {topic.name: topic.readers for topic in topic_table(scenario.config, roster).values()}
    return Flown(
        wire.sent,
        _decisive(wire.sent),
        _rejected(wire.sent),
        {
            name: sum(number for topic, number in wire.strange.items() if name in readers[topic])
            for name in names
        },
    )


def _decisive(sent: Sent) -> dict[str, list[Any]]:
    found: defaultdict[str, list[Any]] = defaultdict(list)
    for topic, message in sent:
        if topic not in (DIAGNOSTICS, SOLVER):
            found[topic].append(bits(message))
    return dict(found)


def _rejected(sent: Sent) -> dict[str, dict[str, int]]:
    found: dict[str, dict[str, int]] = {}
    for topic, message in sent:
        for status in message.status if topic == DIAGNOSTICS else ():
            found[status.name] = {
                entry.key.removeprefix("rejected."): int(entry.value)
                for entry in status.values
                if entry.key.startswith("rejected.")
            }
    return found
