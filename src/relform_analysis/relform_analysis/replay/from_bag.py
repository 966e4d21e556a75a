"""What a recorded flight's controller was given and what it answered, step by step, from the bag alone."""

from collections import defaultdict
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rclpy.serialization import deserialize_message

from relform_analysis.flight.from_bag import load_attached_scenario
from relform_analysis.replay.replay import RecordedFlight, RecordedStep
from relform_bags.message_types import message_class
from relform_bags.reader import BagAttachment, BagMessage, find_bag, read_bag
from relform_core.errors import BagError, MessageError
from relform_core.live_values import Value
from relform_core.load import LoadedScenario
from relform_core.measurements import TeamMeasurements, VehicleMeasurements
from relform_core.names import CONFIG_ATTACHMENT, CONTROLLER_NODE, EVENTS, ROTOR_SPEEDS, vehicle_topic
from relform_core.schema import Vector3
from relform_core.sensors.sensor import Measurement, Sensor
from relform_core.telemetry import FormationSet, ParametersSet, StepDecided
from relform_msgs.msg import FormationEvent as FormationEventMsg
from relform_ros.commands import rotor_command_from_msg
from relform_ros.events import event_from_msg
from relform_ros.sensors.wire import wire


def read_recorded_flight(path: Path) -> RecordedFlight:
    """Read a flight; of a bag that was cut off, the steps that are complete.

    Args:
        path: the bag's file or folder, or the folder of the run.
    Raises:
        BagError: one line: there is no bag, it is not of relform, or it holds no control step.
    """
    file = find_bag(path)
    config_text: str | None = None
    messages: dict[tuple[str, int], Any] = {}
    events: list[FormationEventMsg] = []
    for entry in read_bag(file):
        match entry:
            case BagAttachment(name, text) if name == CONFIG_ATTACHMENT:
                config_text = text
            case BagMessage(topic, type_name, data) if topic == EVENTS:
                events.append(deserialize_message(data, message_class(type_name)))
            case BagMessage(topic, type_name, data):
                messages[topic, entry.log_time_ns] = type_name, data
    if config_text is None:
        raise BagError(f"{file}: not a bag of relform: it has no attachment {CONFIG_ATTACHMENT}")
    scenario = load_attached_scenario(config_text, file)
    try:
        steps = _steps(scenario, messages, events)
    except MessageError as error:
        raise BagError(f"{file}: {error}") from None
    if not steps:
        raise BagError(
            f"{file}: no complete control step in it: sensors, rotor_speeds and {EVENTS} are needed"
        )
    return RecordedFlight(file, config_text, scenario, steps)


def _steps(
    scenario: LoadedScenario, messages: Mapping[tuple[str, int], Any], events: list[FormationEventMsg]
) -> tuple[RecordedStep, ...]:
    """The steps from the first one on for which everything is there."""
    config = scenario.config
    formations: dict[int, Mapping[str, Vector3]] = {}
    parameters: dict[int, Mapping[str, Value]] = {}
    decided: dict[int, StepDecided] = {}
    for msg in events:
        event = event_from_msg(msg, config.team)
        match event.value.content:
            case FormationSet(formation):
                formations[event.step] = formation
            case ParametersSet(changes) if event.value.source == CONTROLLER_NODE:
                parameters[event.step] = changes
            case StepDecided() as decision:
                decided[event.step] = decision
    steps: list[RecordedStep] = []
    for step in range(len(decided)):
        if step not in decided:
            break
        stamp_ns = step * config.period_ns
        inputs: defaultdict[str, list[int]] = defaultdict(list)
        for topic, input_ns in decided[step].inputs:
            inputs[topic].append(input_ns)
        given = {}
        for vehicle in config.team.vehicles:
            arrived: list[tuple[Sensor[Any, Any], Measurement]] = []
            for sensor in config.sensors_of(vehicle):
                topic = vehicle_topic(vehicle, sensor.name)
                for message in filter(None, (messages.get((topic, each)) for each in inputs[topic])):
                    msg = _deserialized(message)
                    arrived.append((sensor, wire(sensor).from_msg(msg, vehicle, config.team.vehicles)))
            given[vehicle] = VehicleMeasurements.collect(arrived)
        commands = {}
        for vehicle in config.team.vehicles:
            if decided[step].waiting_for:
                break  # there were no commands yet
            message = messages.get((vehicle_topic(vehicle, ROTOR_SPEEDS), stamp_ns))
            if message is None:
                return tuple(steps)
            commands[vehicle] = rotor_command_from_msg(_deserialized(message), vehicle)
        measurements = TeamMeasurements(step, stamp_ns, given)
        steps.append(
            RecordedStep(
                measurements,
                formations.get(step),
                parameters.get(step, {}),
                decided[step].sqp_steps,
                commands,
            )
        )
    return tuple(steps)


def _deserialized(message: tuple[str, bytes]) -> Any:
    type_name, data = message
    return deserialize_message(data, message_class(type_name))
