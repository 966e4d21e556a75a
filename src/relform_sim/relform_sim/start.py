"""Where the vehicles of a team are at the start of a flight."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from relform_core.errors import FlightError
from relform_core.ground_config import column_spacing
from relform_core.randomness import Stream, spawn_generator
from relform_core.scenario_config import ScenarioConfig
from relform_core.schema import Vector3

DRAWS_MAX = 1000
"""How often the place of a follower is drawn before the start counts as impossible."""
CLEARANCE = 1.1
"""Vehicles with a drawn place are at least this many collision distances from the others."""


@dataclass(frozen=True)
class StartPose:
    """Where a vehicle starts, level and at rest."""

    p_NB_N: Vector3
    """[m]"""
    yaw: float
    """[rad]"""


def start_poses(config: ScenarioConfig, seed: int) -> Mapping[str, StartPose]:
    """Start of every vehicle, in team order: the same in every process of a flight.

    A follower is at its place of the first formation, displaced and turned at random as far as
    ``config.start`` says. In team order, a point that is too close to a vehicle before is drawn again. With
    ``config.ground`` the vehicles are on the ground below these points, which are far enough apart to take
    off from.

    Raises:
        FlightError: no point far enough from the others was found.
    """
    start, places = config.start, config.start_places
    poses = {config.team.leader: StartPose(_below(config, start.position), start.yaw)}
    for index, name in enumerate(config.team.followers, start=1):
        place = places[name]
        turn = 0.0
        generator = spawn_generator(seed, index, Stream.START)
        if start.follower_yaw_max > 0.0:
            turn = generator.uniform(-start.follower_yaw_max, start.follower_yaw_max)
        if start.follower_offset_max > 0.0:
            others = [pose.p_NB_N for pose in poses.values()]
            place = _displaced(config, generator, name, place, others)
        poses[name] = StartPose(_below(config, place), start.yaw + turn)
    return poses


def _below(config: ScenarioConfig, place: Vector3) -> Vector3:
    """The point on the ground below a place; without ground the place itself."""
    return place if config.ground is None else (place[0], place[1], config.vehicle.leg_height)


def _displaced(
    config: ScenarioConfig, generator: np.random.Generator, name: str, place: Vector3, others: list[Vector3]
) -> Vector3:
    """A random point of the ball around a place, clear of the other vehicles."""
    radius, separation_min = config.start.follower_offset_max, config.vehicle.separation_min
    needed = CLEARANCE * separation_min if config.ground is None else column_spacing(separation_min)
    for _ in range(DRAWS_MAX):
        direction = generator.standard_normal(3)
        distance = radius * generator.uniform() ** (1.0 / 3.0)  # uniform in the volume
        dx, dy, dz = (distance / np.linalg.norm(direction) * direction).tolist()
        point = _below(config, (place[0] + dx, place[1] + dy, place[2] + dz))
        if all(math.dist(point, other) >= needed for other in others):
            return point
    raise FlightError(
        f"no start for '{name}': none of {DRAWS_MAX} points within {radius:g} m of its place "
        f"(start.follower_offset_max_m) is {needed:g} m or more away from the vehicles before it"
    )
