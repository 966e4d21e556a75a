"""The topics that a view reads, and where their messages go."""

from functools import partial
from typing import Any

from relform_core.names import GROUND_TRUTH, vehicle_topic
from relform_core.roster import Roster
from relform_core.sensors.range_bearing import RANGE_BEARING
from relform_live.scene.channel import Channel
from relform_live.scene.flight_data import FlightData
from relform_ros.events import event_from_msg
from relform_ros.odometry import odometry_from_msg
from relform_ros.sensors import range_bearing
from relform_ros.team_status import status_from_msg
from relform_ros.telemetry import reference_from_msg, solver_from_msg, state_from_msg

SAMPLES_KEPT = 8
"""Poses that may wait for the next frame."""
EVENTS_KEPT = 200


def channels(data: FlightData) -> dict[str, Channel]:
    """What takes in the messages of a flight, by topic."""
    config = data.config
    team, vehicles = config.team, config.team.vehicles
    controller = Roster.of(config).controllers[0]

    def take_truth(vehicle: str, msg: Any) -> None:
        data.take_truth(vehicle, odometry_from_msg(msg, vehicle))

    def take_sightings(vehicle: str, msg: Any) -> None:
        data.take_sightings(vehicle, range_bearing.from_msg(msg, vehicle, vehicles))

    of_team = {
        controller.state: Channel(lambda msg: data.take_state(state_from_msg(msg, vehicles))),
        controller.reference: Channel(lambda msg: data.take_reference(reference_from_msg(msg, vehicles))),
        controller.solver: Channel(lambda msg: data.take_solver(solver_from_msg(msg))),
        controller.events: Channel(
            lambda msg: data.take_event(event_from_msg(msg, team)), EVENTS_KEPT, keeps_all=True
        ),
    }
    truths = {
        vehicle_topic(vehicle, GROUND_TRUTH): Channel(partial(take_truth, vehicle), SAMPLES_KEPT)
        for vehicle in vehicles
    }
    sightings = {
        vehicle_topic(vehicle, RANGE_BEARING.name): Channel(partial(take_sightings, vehicle))
        for vehicle in vehicles
    }
    if config.ground is not None:
        of_team[controller.status] = Channel(lambda msg: data.take_status(status_from_msg(msg)))
    return of_team | truths | sightings
