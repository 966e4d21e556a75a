"""The topics of a flight: one table of names, types, writers and readers that every node uses."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from nav_msgs.msg import Odometry
from rclpy.qos import QoSProfile
from rosgraph_msgs.msg import Clock

from relform_core.names import (
    CLOCK,
    CLOCK_NODE,
    CONTROLLER_NODE,
    DIAGNOSTICS,
    EVENTS,
    GROUND_TRUTH,
    MONITOR_NODE,
    REFERENCE,
    ROTOR_SPEEDS,
    SOLVER,
    STATE,
    step_done_topic,
    vehicle_node,
    vehicle_topic,
)
from relform_core.scenario_config import ScenarioConfig, TeamConfig
from relform_msgs.msg import (
    FormationEvent,
    FormationReference,
    FormationState,
    RotorSpeeds,
    SolverStatus,
    StepDone,
)
from relform_ros.qos import LATCHED, LOCKSTEP
from relform_ros.sensors.wire import wire


@dataclass(frozen=True)
class Topic:
    """One topic: who writes and who reads it, by fully qualified node name."""

    name: str
    type: type[Any]
    writers: tuple[str, ...]
    readers: tuple[str, ...]
    qos: QoSProfile = field(default_factory=lambda: LOCKSTEP)


def members(team: TeamConfig, observers: Sequence[str]) -> tuple[str, ...]:
    """Fully qualified names of all members of the barrier."""
    return (*map(vehicle_node, team.vehicles), CONTROLLER_NODE, *observers)


def topic_table(config: ScenarioConfig, observers: Sequence[str]) -> dict[str, Topic]:
    """All topics of a flight by name.

    Args:
        observers: fully qualified names of the members beside vehicles and controller. They read every topic,
            except that the monitor does without the sensors.
    """
    team = config.team
    vehicle_nodes = {vehicle: vehicle_node(vehicle) for vehicle in team.vehicles}
    all_members = members(team, observers)
    observers = tuple(observers)
    sensor_observers = tuple(node for node in observers if node != MONITOR_NODE)
    controller = (CONTROLLER_NODE,)
    topics = [
        Topic(CLOCK, Clock, (CLOCK_NODE,), all_members),
        # Of what the others have finished, each reads only what it waits for: n messages per step, not n^2.
        *(
            Topic(
                step_done_topic(node), StepDone, (node,), (CLOCK_NODE, CONTROLLER_NODE, *observers), LATCHED
            )
            for node in vehicle_nodes.values()
        ),
        Topic(
            step_done_topic(CONTROLLER_NODE),
            StepDone,
            controller,
            (CLOCK_NODE, *vehicle_nodes.values(), *observers),
            LATCHED,
        ),
        *(Topic(step_done_topic(node), StepDone, (node,), (CLOCK_NODE,), LATCHED) for node in observers),
        Topic(EVENTS, FormationEvent, (*vehicle_nodes.values(), CONTROLLER_NODE), observers, LATCHED),
        Topic(STATE, FormationState, controller, observers),
        Topic(SOLVER, SolverStatus, controller, observers),
        Topic(REFERENCE, FormationReference, controller, observers),
        Topic(DIAGNOSTICS, DiagnosticArray, (CLOCK_NODE, *all_members), sensor_observers),
    ]
    for vehicle, node in vehicle_nodes.items():
        others = tuple(other for other in vehicle_nodes.values() if other != node)
        topics += [
            *(
                Topic(
                    vehicle_topic(vehicle, sensor.name),
                    wire(sensor).MESSAGE,
                    (node,),
                    (CONTROLLER_NODE, *sensor_observers),
                )
                for sensor in config.sensors_of(vehicle)
            ),
            Topic(vehicle_topic(vehicle, GROUND_TRUTH), Odometry, (node,), (*others, *observers)),
            Topic(vehicle_topic(vehicle, ROTOR_SPEEDS), RotorSpeeds, controller, (node, *observers)),
        ]
    return {topic.name: topic for topic in topics}
