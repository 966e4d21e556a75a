"""Whatever a stranger sends on the topics of a flight: it is counted by its reason, and changes nothing.

The long form of this test: ``RELFORM_EXAMPLES=2000 pytest tests/ros/test_strange_messages.py``.
"""

import os
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from random import Random
from typing import Any

import pytest
import rclpy
from hypothesis import Phase, given, settings
from hypothesis import strategies as st
from rclpy.context import Context

from relform_controller.team_controller import make_controller
from relform_core.load import LoadedScenario
from relform_core.measurements import TeamMeasurements, VehicleMeasurements
from relform_core.names import EVENTS, ROTOR_SPEEDS, vehicle_topic
from relform_core.roster import Roster
from relform_core.telemetry import StepDecided
from relform_ros.commands import rotor_command_from_msg
from relform_ros.events import event_from_msg
from relform_ros.fields import stamp_from_msg
from relform_ros.sensors.wire import wire
from relform_ros.topics import topic_table
from support.corruption import strange_message
from support.disturbed import Flown, fly_disturbed
from support.nodes import short
from support.scenarios import paper_scenario
from support.wire import bits

EXAMPLES = int(os.environ.get("RELFORM_EXAMPLES", "4"))
PER_FLIGHT = 60
FLOOD = 10
"""How often a stranger sends the same when it floods a topic."""
FIRST, LAST = 3, 5
"""Steps at the start and at the end without strange messages: what is sent last is not yet counted."""

N_STEPS = 40
FLIGHTS = {
    "raw": (short(2.0),),
    "team, links": (
        short(2.0),
        "controller=team",
        "links={up: {delay_s: 0.05}, down: {delay_s: 0.05}}",
    ),
    "ground": (short(2.0), "controller=team", "ground={waits: true}"),
}


@pytest.fixture(scope="module")
def context() -> Iterator[Context]:
    context = Context()
    rclpy.init(context=context)
    yield context
    rclpy.shutdown(context=context)


@dataclass(frozen=True)
class Strange:
    """What a stranger sends beside one message."""

    topic: str
    step: int
    """Ordinal of the message within its topic."""
    is_first: bool
    """Whether it arrives before that message."""
    copies: int
    choice: int
    """What is sent, see ``strange_message``."""


def strangers(scenario: LoadedScenario) -> st.SearchStrategy[list[Strange]]:
    table = topic_table(scenario.config, Roster.of(scenario.config))
    read = sorted(topic.name for topic in table.values() if topic.readers)
    steps = st.integers(FIRST, N_STEPS - LAST)
    each = st.builds(
        Strange, st.sampled_from(read), steps, st.booleans(), st.sampled_from((1, 1, FLOOD)), st.integers(0)
    )
    return st.lists(each, min_size=1, max_size=PER_FLIGHT)


Flight = tuple[LoadedScenario, Path, Context]


def disturbed(flight: Flight, strange_ones: Iterable[Strange]) -> Flown:
    """A flight with a stranger."""
    scenario, folder, context = flight
    beside: defaultdict[tuple[str, int], list[Strange]] = defaultdict(list)
    for strange in strange_ones:
        beside[strange.topic, strange.step].append(strange)

    def disturb(topic: str, message: Any, before: Sequence[Any]) -> tuple[list[Any], list[Any]]:
        first: list[Any] = []
        last: list[Any] = []
        for strange in beside[topic, len(before)]:
            sent = strange_message(message, scenario.config.period_ns, Random(strange.choice))
            (first if strange.is_first else last).extend([sent] * strange.copies)
        return first, last

    return fly_disturbed(scenario, folder, context, disturb, N_STEPS)


def assert_all_counted(flown: Flown) -> None:
    assert {node: sum(reasons.values()) for node, reasons in flown.rejected.items()} == flown.strange


@pytest.mark.parametrize("name", FLIGHTS)
def test_a_stranger_changes_nothing(name: str, context: Context, tmp_path: Path) -> None:
    scenario = paper_scenario(*FLIGHTS[name], seed=4)
    flight = scenario, tmp_path, context
    expected = disturbed(flight, [])

    @given(strangers(scenario))
    @settings(max_examples=EXAMPLES, phases=(Phase.generate,))
    def holds(strange_ones: list[Strange]) -> None:
        flown = disturbed(flight, strange_ones)
        assert flown.decisive == expected.decisive
        assert_all_counted(flown)

    holds()


def test_a_stranger_changes_nothing_in_real_time(context: Context, tmp_path: Path) -> None:
    """Each decision follows from what the vehicles sent themselves."""
    scenario = paper_scenario(short(2.0), "controller=team", "pacing=real_time", seed=4)

    @given(strangers(scenario))
    @settings(max_examples=max(1, EXAMPLES // 3), phases=(Phase.generate,))
    def holds(strange_ones: list[Strange]) -> None:
        flown = disturbed((scenario, tmp_path, context), strange_ones)
        assert_all_counted(flown)
        assert_decided_on_what_was_sent(scenario, flown)

    holds()


def assert_decided_on_what_was_sent(scenario: LoadedScenario, flown: Flown) -> None:
    """Give the controller those messages of the vehicles that it says to have used, and compare."""
    team = scenario.config.team
    by_stamp = {
        (topic, stamp_from_msg(message.header.stamp)): message
        for topic, message in flown.sent
        if hasattr(message, "header")
    }
    sources = {
        vehicle_topic(vehicle, source.name): (vehicle, source)
        for vehicle in team.vehicles
        for source in scenario.config.sources_of(vehicle)
    }
    controller = make_controller(scenario.config)
    n_compared = 0
    for event in [event_from_msg(message, team) for topic, message in flown.sent if topic == EVENTS]:
        assert isinstance(event.value.content, StepDecided)
        arrived: dict[str, list[Any]] = {vehicle: [] for vehicle in team.vehicles}
        for topic, stamp_ns in event.value.content.inputs:
            vehicle, source = sources[topic]
            measurement = wire(source).from_msg(by_stamp[topic, stamp_ns], vehicle, team.vehicles)
            arrived[vehicle].append((source, measurement))
        given_ = {vehicle: VehicleMeasurements.collect(each) for vehicle, each in arrived.items()}
        measurements = TeamMeasurements(event.step, event.stamp_ns, given_)
        decision = controller.step(measurements, event.value.content.sqp_steps or None)
        for vehicle, command in decision.commands.items():
            flown_command = by_stamp[vehicle_topic(vehicle, ROTOR_SPEEDS), command.stamp_ns]
            assert bits(rotor_command_from_msg(flown_command, vehicle)) == bits(command)
            n_compared += 1
    assert n_compared > N_STEPS
