"""Messages of a flight as entries of its log, live or from a bag."""

import sys
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

from relform_analysis.flight.bag_configuration import find_configuration
from relform_analysis.flight.log import FlightLog
from relform_analysis.flight.log_builder import FlightLogBuilder
from relform_bags.from_bag import decode
from relform_bags.reader import BagMessage, find_bag, read_bag
from relform_core.errors import BagError
from relform_core.names import DIAGNOSTICS, GROUND_TRUTH, ROTOR_SPEEDS, vehicle_topic
from relform_core.roster import Controller, Roster
from relform_core.scenario_config import ScenarioConfig
from relform_ros.commands import rotor_command_from_msg
from relform_ros.events import event_from_msg
from relform_ros.fields import stamp_from_msg
from relform_ros.odometry import odometry_from_msg
from relform_ros.rejection import RejectionError, Rejections
from relform_ros.team_status import status_from_msg
from relform_ros.telemetry import reference_from_msg, solver_from_msg, state_from_msg


def message_takers(
    builder: FlightLogBuilder,
    config: ScenarioConfig,
    controller: Controller | None = None,
    rejections: Rejections | None = None,
) -> Mapping[str, Callable[[Any], None]]:
    """What adds a message to a log, by topic.

    As the nodes of the flight did, it leaves out what cannot be used, and takes the first of several messages
    of one instant.

    Args:
        builder: of the log.
        config: scenario that is flown.
        controller: the log is about this one; None: the one that commands the whole team.
        rejections: count what is left out because it cannot be used.
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

    single: dict[str, Callable[[Any], None]] = {
        controller.reference: lambda msg: builder.add_reference(reference_from_msg(msg, team.vehicles)),
        controller.state: lambda msg: builder.add_state(state_from_msg(msg, team.vehicles)),
        controller.solver: lambda msg: builder.add_solver(solver_from_msg(msg)),
    }
    if config.ground is not None:
        single[controller.status] = lambda msg: builder.add_status(status_from_msg(msg))
    for vehicle in team.vehicles:
        single[vehicle_topic(vehicle, GROUND_TRUTH)] = partial(take_ground_truth, vehicle)
        single[vehicle_topic(vehicle, ROTOR_SPEEDS)] = partial(take_command, vehicle)
    takers: dict[str, Callable[[Any], None]] = {
        topic: partial(_take_first, take, set()) for topic, take in single.items()
    }
    takers[controller.events] = lambda msg: builder.add_event(event_from_msg(msg, team))
    if config.real_time is not None:
        takers[DIAGNOSTICS] = take_diagnostics
    rejections = rejections or Rejections()
    return {topic: partial(_take_usable, topic, take, rejections) for topic, take in takers.items()}


def _take_first(take: Callable[[Any], None], known_ns: set[int], msg: Any) -> None:
    """Take a message unless another one of its stamp was taken before."""
    stamp_ns = stamp_from_msg(msg.header.stamp)
    if stamp_ns not in known_ns:
        take(msg)
        known_ns.add(stamp_ns)


def _take_usable(topic: str, take: Callable[[Any], None], rejections: Rejections, msg: Any) -> None:
    try:
        take(msg)
    except RejectionError as rejected:
        rejections.count(topic, rejected)


def read_flight_log(path: Path | str, configuration: Path | str | None = None) -> FlightLog:
    """Read a flight, as far as its bag goes.

    Args:
        path: the bag's file or folder, or the folder of the run.
        configuration: path or plain name of the scenario; None: as ``find_configuration`` finds it.
    Raises:
        BagError: one line: there is no bag, no configuration or no flight, or a type cannot be used.
    """
    bag = find_bag(path)
    scenario = find_configuration(bag, configuration).load()
    builder, rejections = FlightLogBuilder(scenario), Rejections()
    takers = message_takers(builder, scenario.config, rejections=rejections)
    _take(bag, takers, rejections)
    unused = f"{rejections.total} messages cannot be used, the last one on {rejections.last}"
    if missing := builder.missing():
        raise BagError(f"{bag}: no flight in it: {missing}{f'; {unused}' if rejections.total else ''}")
    if rejections.total:
        print(f"{bag}: left out: {unused}", file=sys.stderr)
    return builder.build()


def read_ground_truth(bag: Path, builder: FlightLogBuilder, config: ScenarioConfig) -> None:
    """Add the true states of all vehicles to a log.

    Raises:
        BagError: one line: a type cannot be used, or the bag cannot be read.
    """
    topics = {vehicle_topic(vehicle, GROUND_TRUTH) for vehicle in config.team.vehicles}
    takers = message_takers(builder, config)
    _take(bag, {topic: take for topic, take in takers.items() if topic in topics}, Rejections())


def _take(bag: Path, takers: Mapping[str, Callable[[Any], None]], rejections: Rejections) -> None:
    """Give every message of a bag to what takes its topic; those that cannot be decoded are counted.

    Raises:
        BagError: one line: a type cannot be used, or the bag cannot be read.
    """
    for entry in read_bag(bag, takers):
        if isinstance(entry, BagMessage):
            try:
                takers[entry.topic](_decoded(bag, entry))
            except RejectionError as rejected:
                rejections.count(entry.topic, rejected)


def _decoded(bag: Path, entry: BagMessage) -> Any:
    try:
        return decode(entry)
    except BagError as error:
        raise BagError(f"{bag}: {entry.topic}: {error}") from None
