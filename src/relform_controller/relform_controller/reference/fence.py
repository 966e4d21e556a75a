"""Whether the references of a team stay inside the geofence of its scenario."""

from collections.abc import Callable, Mapping

import numpy as np

from relform_controller.ocp.frames import rotations_z
from relform_controller.reference.formation import FormationSchedule
from relform_controller.reference.trajectory import LeaderReference, LeaderTrajectory
from relform_core.arrays import Array
from relform_core.errors import ConfigError
from relform_core.geofence_config import GeofenceConfig
from relform_core.scenario_config import ScenarioConfig
from relform_core.schema import Vector3
from relform_core.units import NANOSECONDS_PER_SECOND


def check_place(
    fence: GeofenceConfig, vehicle: str, place: Vector3 | Array, way: LeaderReference, margin: float
) -> None:
    """Check a vehicle that keeps its place beside the leader.

    Args:
        fence: of the scenario.
        vehicle: its name.
        place: in {mc} of the leader [m], shape (3,), or one for each instant, shape (instant, 3).
        way: of the leader.
        margin: how far inside the vehicle must stay [m].
    Raises:
        ConfigError: it leaves the geofence.
    """
    p_NB_N = way.p_NB_N + np.einsum("tij,...tj->ti", rotations_z(way.yaw_NB), np.atleast_2d(place))
    if breach := fence.breach(p_NB_N, margin):
        raise ConfigError(f"'{vehicle}' would leave the geofence: {breach}")


def check_scenario(config: ScenarioConfig) -> None:
    """Check the phases of a scenario before it is flown.

    Raises:
        ConfigError: a vehicle leaves the geofence, or comes too close to it.
    """
    if config.geofence is not None:
        trajectory = LeaderTrajectory(config, n_extra=0)
        check_phases(
            config,
            lambda times: trajectory.at(np.rint(times * NANOSECONDS_PER_SECOND).astype(np.int64)),
            config.geofence.margin,
        )


def check_phases(config: ScenarioConfig, leader: Callable[[Array], LeaderReference], margin: float) -> None:
    """Check the phases of a scenario, with the changes of formation between them.

    Args:
        config: the scenario.
        leader: its reference at times since the start of the phases [s], shape (instant,).
        margin: how far inside every vehicle must stay [m].
    Raises:
        ConfigError: a vehicle leaves the geofence.
    """
    if config.geofence is None:
        return
    n_steps = round(config.duration / config.controller.period)
    schedule = FormationSchedule(config)
    places: list[Mapping[str, Vector3]] = []
    for step in range(n_steps):
        schedule.advance(step * config.period_ns)
        places.append(schedule.from_next_step_on()[0])
    times = np.arange(1, n_steps + 1) * config.period_ns / NANOSECONDS_PER_SECOND
    way = leader(times)
    check_place(config.geofence, config.team.leader, np.zeros(3), way, margin)
    for follower in config.team.followers:
        of_follower = np.array([each[follower] for each in places])
        check_place(config.geofence, follower, of_follower, way, margin)
