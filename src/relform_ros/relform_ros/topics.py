"""The topics of a flight: one table of names, types, writers and readers that every node uses."""

from dataclasses import dataclass, field
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from nav_msgs.msg import Odometry
from rclpy.qos import QoSProfile
from rosgraph_msgs.msg import Clock

from relform_core.names import (
    CLOCK,
    CLOCK_NODE,
    DIAGNOSTICS,
    GROUND_TRUTH,
    MEMBERS,
    MONITOR_NODE,
    ROTOR_SPEEDS,
    step_done_topic,
    vehicle_node,
    vehicle_topic,
)
from relform_core.roster import Controller, Roster
from relform_core.scenario_config import ScenarioConfig
from relform_msgs.msg import (
    FormationEvent,
    FormationReference,
    FormationState,
    MemberChange,
    RotorSpeeds,
    Separation,
    SolverStatus,
    StepDone,
    TeamStatus,
)
from relform_ros.qos import LATCHED, LOCKSTEP
from relform_ros.sensors.wire import wire


@dataclass(frozen=True)
class Topic:
    """One topic, with its writers and readers by fully qualified node name."""

    name: str
    type: type[Any]
    writers: tuple[str, ...]
    readers: tuple[str, ...]
    qos: QoSProfile = field(default_factory=lambda: LOCKSTEP)


def topic_table(config: ScenarioConfig, roster: Roster) -> dict[str, Topic]:
    """All topics of a flight by name.

    Observers read every topic, except that the monitor does without the sensors, and in lock-step without the
    diagnostics.
    """
    sensor_observers = tuple(node for node in roster.observers if node != MONITOR_NODE)
    interested = sensor_observers if config.real_time is None else roster.observers
    topics = [
        Topic(CLOCK, Clock, (CLOCK_NODE,), roster.members),
        Topic(MEMBERS, MemberChange, (CLOCK_NODE,), roster.members, LATCHED),
        Topic(DIAGNOSTICS, DiagnosticArray, (CLOCK_NODE, *roster.members), interested),
        *(topic for controller in roster.controllers for topic in _of_controller(controller, config, roster)),
        *(topic for vehicle in roster.vehicles for topic in _of_vehicle(vehicle, config, roster)),
        *(_step_done(node, ()) for node in roster.observers),
    ]
    return {topic.name: topic for topic in topics}


def _of_controller(controller: Controller, config: ScenarioConfig, roster: Roster) -> list[Topic]:
    writer = (controller.node,)
    vehicles = tuple(map(vehicle_node, controller.vehicles))
    return [
        _step_done(controller.node, (*vehicles, *roster.observers)),
        Topic(controller.events, FormationEvent, (*vehicles, *writer), roster.observers, LATCHED),
        Topic(controller.state, FormationState, writer, roster.observers),
        Topic(controller.solver, SolverStatus, writer, roster.observers),
        Topic(controller.reference, FormationReference, writer, roster.observers),
        *(
            []
            if config.separation is None
            else [Topic(controller.separation, Separation, writer, roster.observers)]
        ),
        *(() if config.ground is None else [Topic(controller.status, TeamStatus, writer, roster.observers)]),
    ]


def _of_vehicle(vehicle: str, config: ScenarioConfig, roster: Roster) -> list[Topic]:
    node, commander = vehicle_node(vehicle), roster.commander(vehicle).node
    others = tuple(vehicle_node(other) for other in roster.vehicles if other != vehicle)
    sensor_readers = (commander, *(node for node in roster.observers if node != MONITOR_NODE))
    return [
        _step_done(node, (commander, *roster.observers)),
        Topic(vehicle_topic(vehicle, GROUND_TRUTH), Odometry, (node,), (*others, *roster.observers)),
        Topic(vehicle_topic(vehicle, ROTOR_SPEEDS), RotorSpeeds, (commander,), (node, *roster.observers)),
        *(
            Topic(vehicle_topic(vehicle, source.name), wire(source).MESSAGE, (node,), sensor_readers)
            for source in config.sources_of(vehicle)
        ),
    ]


def _step_done(node: str, readers: tuple[str, ...]) -> Topic:
    """The end of each step of a node: read by those that wait for its messages, so n readers, not n^2."""
    return Topic(step_done_topic(node), StepDone, (node,), (CLOCK_NODE, *readers), LATCHED)
