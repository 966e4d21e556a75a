"""What the bag of a flight of the campaign says, read by relform's reader and by the library ``mcap``."""

from collections import defaultdict
from collections.abc import Iterable
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from mcap.exceptions import McapError
from mcap.reader import make_reader

from relform_analysis.flight.from_bag import message_takers
from relform_analysis.flight.log import FlightLog
from relform_analysis.flight.log_builder import FlightLogBuilder
from relform_analysis.flight.tracking_errors import formation_errors, scored_pairs
from relform_bags.from_bag import decode
from relform_bags.reader import BagMessage, bag_files, read_bag
from relform_bags.recover import recover_bag
from relform_bringup.faults.evidence import Flown, VehicleFlown
from relform_core.arrays import Array
from relform_core.errors import BagError
from relform_core.flight_modes import TeamMode, VehicleMode
from relform_core.load import LoadedScenario
from relform_core.names import DIAGNOSTICS, MEMBERS, ROTOR_SPEEDS, STATUS, vehicle_topic
from relform_core.sensors.flight_status import FLIGHT_STATUS
from relform_core.units import NANOSECONDS_PER_SECOND
from relform_msgs.msg import MemberChange
from relform_ros.fields import stamp_from_msg

Mode = TypeVar("Mode", VehicleMode, TeamMode)


def read_flown(bag: Path, scenario: LoadedScenario) -> tuple[Flown | None, str]:
    """What a bag says, and why it cannot be read or in what two readers differ; empty: they agree.

    A bag that its recorder did not close is recovered first.
    """
    try:
        recover_bag(bag)
        messages = [entry for entry in read_bag(bag) if isinstance(entry, BagMessage)]
        flown = _flown(messages, scenario)
        counted = _count_by_mcap(bag)
    except (BagError, McapError) as error:
        return None, f"the bag cannot be read: {error}"
    if counted != len(messages):
        return flown, f"the bag has {len(messages)} messages for relform, {counted} for mcap"
    return flown, ""


def _count_by_mcap(bag: Path) -> int:
    """Number of messages that the library reads by the index of the files."""
    number = 0
    for path in bag_files(bag):
        with path.open("rb") as stream:
            number += sum(1 for _ in make_reader(stream, validate_crcs=True).iter_messages())
    return number


def _flown(messages: list[BagMessage], scenario: LoadedScenario) -> Flown:
    """The content of the messages; of several of one instant, the first counts, as for the nodes.

    Raises:
        BagError: a type cannot be used.
    """
    config = scenario.config
    builder = FlightLogBuilder(scenario)
    takers = message_takers(builder, config)
    by_topic: dict[str, list[Any]] = defaultdict(list)
    for entry in messages:
        message = decode(entry)
        by_topic[entry.topic].append(message)
        if entry.topic in takers:
            takers[entry.topic](message)
    log = builder.build()
    errors, error_times = _formation_errors(log)
    reports = {
        status.name: {each.key: each.value for each in status.values}
        for message in by_topic[DIAGNOSTICS]
        for status in message.status
    }
    return Flown(
        steps=np.rint(log.tick_ns / config.period_ns).astype(np.int64),
        vehicles={name: _vehicle(name, log, by_topic) for name in log.vehicles},
        vehicle_faults=tuple(f"{fault.source}: {fault.description}" for fault in log.faults),
        admissions=tuple(
            (time, change.node, change.kind == MemberChange.ADMITTED)
            for time, change in zip(_times(by_topic[MEMBERS]), by_topic[MEMBERS], strict=True)
        ),
        team_modes=_changes(by_topic[STATUS], TeamMode),
        formation_errors=errors,
        error_times=error_times,
        reports=reports,
    )


def _vehicle(name: str, log: FlightLog, by_topic: dict[str, list[Any]]) -> VehicleFlown:
    index = log.vehicles.index(name)
    x, y, _, _ = log.q_NB[:, index].T
    commands = {_time(each): each.request for each in reversed(by_topic[vehicle_topic(name, ROTOR_SPEEDS)])}
    times = sorted(commands)
    return VehicleFlown(
        times=log.tick_ns / NANOSECONDS_PER_SECOND,
        heights=log.p_NB_N[:, index, 2],
        speeds=np.linalg.norm(log.v_NB_B[:, index], axis=-1),
        tilts=np.arccos(np.clip(1.0 - 2.0 * (x**2 + y**2), -1.0, 1.0)),
        command_times=np.array(times),
        requests=np.array([commands[time] for time in times], dtype=np.int64),
        modes=_changes(by_topic[vehicle_topic(name, FLIGHT_STATUS.name)], VehicleMode),
    )


def _formation_errors(log: FlightLog) -> tuple[Array, Array]:
    """Mean of the scored pairs in each control step [m], and its instant [s]."""
    if not log.phase:
        return np.zeros(0), np.zeros(0)
    errors = formation_errors(log, scored_pairs(log.scenario.config.team)).mean(axis=1)
    return errors, log.tick_ns[log.tick_of_step] / NANOSECONDS_PER_SECOND


def _times(messages: Iterable[Any]) -> tuple[float, ...]:
    return tuple(map(_time, messages))


def _time(message: Any) -> float:
    return stamp_from_msg(message.header.stamp) / NANOSECONDS_PER_SECOND


def _changes(messages: Iterable[Any], modes: type[Mode]) -> tuple[tuple[float, Mode], ...]:
    """Instant and mode at each change."""
    changes: list[tuple[float, Mode]] = []
    for message in messages:
        mode = modes(message.mode)
        if not changes or changes[-1][1] is not mode:
            changes.append((_time(message), mode))
    return tuple(changes)
