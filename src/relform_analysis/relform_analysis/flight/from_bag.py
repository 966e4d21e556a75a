"""Messages of a flight as entries of its log, live or from a bag."""

from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

from relform_analysis.flight.bag_configuration import find_configuration
from relform_analysis.flight.log import FlightLog
from relform_analysis.flight.log_builder import FlightLogBuilder
from relform_bags.from_bag import decode
from relform_bags.reader import BagMessage, find_bag, read_bag
from relform_core.errors import BagError, MessageError
from relform_core.names import DIAGNOSTICS, GROUND_TRUTH, ROTOR_SPEEDS, vehicle_topic
from relform_core.roster import Controller, Roster
from relform_core.scenario_config import ScenarioConfig
from relform_ros.commands import rotor_command_from_msg
from relform_ros.events import event_from_msg
from relform_ros.odometry import odometry_from_msg
from relform_ros.team_status import status_from_msg
from relform_ros.telemetry import reference_from_msg, solver_from_msg, state_from_msg


def message_takers(
    builder: FlightLogBuilder, config: ScenarioConfig, controller: Controller | None = None
) -> Mapping[str, Callable[[Any], None]]:
    """What adds a message to a log, by topic; a message that cannot be used raises MessageError.

    Args:
        builder: of the log.
        config: scenario that is flown.
        controller: the log is about this one; None: the one that commands the whole team.
    """
    team = config.team
    controller = controller or Roster.of(config).controllers[0]

    def take_ground_truth(vehicle: str, msg: Any) -> None:
        builder.add_ground_truth(vehicle, odometry_from_msg(msg, vehicle))

    def take_command(vehicle: str, msg: Any) -> None:
        builder.add_command(vehicle, rotor_command_from_msg(msg, vehicle))

    def take_diagnostics(msg: Any) -> None:
        for status in msg.status:
            builder.add_report(status.name, {each.key: each.value for each in status.values})

    takers: dict[str, Callable[[Any], None]] = {
        controller.reference: lambda msg: builder.add_reference(reference_from_msg(msg, team.vehicles)),
        controller.state: lambda msg: builder.add_state(state_from_msg(msg, team.vehicles)),
        controller.solver: lambda msg: builder.add_solver(solver_from_msg(msg)),
        controller.events: lambda msg: builder.add_event(event_from_msg(msg, team)),
    }
    if config.ground is not None:
        takers[controller.status] = lambda msg: builder.add_status(status_from_msg(msg))
    if config.real_time is not None:
        takers[DIAGNOSTICS] = take_diagnostics
    for vehicle in team.vehicles:
        takers[vehicle_topic(vehicle, GROUND_TRUTH)] = partial(take_ground_truth, vehicle)
        takers[vehicle_topic(vehicle, ROTOR_SPEEDS)] = partial(take_command, vehicle)
    return takers


def read_flight_log(path: Path | str, configuration: Path | str | None = None) -> FlightLog:
    """Read a flight, as far as its bag goes.

    Args:
        path: the bag's file or folder, or the folder of the run.
        configuration: path or plain name of the scenario; None: as ``find_configuration`` finds it.
    Raises:
        BagError: one line: there is no bag, no configuration or no flight, or a message cannot be used.
    """
    bag = find_bag(path)
    scenario = find_configuration(bag, configuration).load()
    builder = FlightLogBuilder(scenario)
    takers = message_takers(builder, scenario.config)
    _take(bag, takers)
    if missing := builder.missing():
        raise BagError(f"{bag}: no flight in it: {missing}")
    return builder.build()


def read_ground_truth(bag: Path, builder: FlightLogBuilder, config: ScenarioConfig) -> None:
    """Add the true states of all vehicles to a log.

    Raises:
        BagError: one line: a message cannot be used, or the bag cannot be read.
    """
    topics = {vehicle_topic(vehicle, GROUND_TRUTH) for vehicle in config.team.vehicles}
    takers = message_takers(builder, config)
    _take(bag, {topic: take for topic, take in takers.items() if topic in topics})


def _take(bag: Path, takers: Mapping[str, Callable[[Any], None]]) -> None:
    """Give every message of a bag to what takes its topic.

    Raises:
        BagError: one line: a message cannot be used, or the bag cannot be read.
    """
    for entry in read_bag(bag, takers):
        if isinstance(entry, BagMessage):
            try:
                takers[entry.topic](decode(entry))
            except MessageError as error:
                raise BagError(f"{bag}: {entry.topic}: {error}") from None
