"""Where the vehicles of a team are at the start of a flight."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from relform_core.errors import FlightError
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
    ``config.start`` says. In team order, a point that is too close to a vehicle before is drawn again.

    Raises:
        FlightError: no point far enough from the others was found.
    """
    start = config.start
    x, y, z = start.position
    cosine, sine = math.cos(start.yaw), math.sin(start.yaw)
    poses = {config.team.leader: StartPose(start.position, start.yaw)}
    formation = config.formations[config.phases[0].formation]
    for index, name in enumerate(config.team.followers, start=1):
        forward, left, up = formation[name]
        place = (x + cosine * forward - sine * left, y + sine * forward + cosine * left, z + up)
        turn = 0.0
        generator = spawn_generator(seed, index, Stream.START)
        if start.follower_yaw_max > 0.0:
            turn = generator.uniform(-start.follower_yaw_max, start.follower_yaw_max)
        if start.follower_offset_max > 0.0:
            others = [pose.p_NB_N for pose in poses.values()]
            place = _displaced(config, generator, name, place, others)
        poses[name] = StartPose(place, start.yaw + turn)
    return poses


def _displaced(
    config: ScenarioConfig, generator: np.random.Generator, name: str, place: Vector3, others: list[Vector3]
) -> Vector3:
    """A random point of the ball around a place, clear of the other vehicles."""
    radius, needed = config.start.follower_offset_max, CLEARANCE * config.vehicle.separation_min
    for _ in range(DRAWS_MAX):
        direction = generator.standard_normal(3)
        distance = radius * generator.uniform() ** (1.0 / 3.0)  # uniform in the volume
        dx, dy, dz = (distance / np.linalg.norm(direction) * direction).tolist()
        point = (place[0] + dx, place[1] + dy, place[2] + dz)
        if all(math.dist(point, other) >= needed for other in others):
            return point
    raise FlightError(
        f"no start for '{name}': none of {DRAWS_MAX} points within {radius:g} m of its place "
        f"(start.follower_offset_max_m) is {needed:g} m or more away from the vehicles before it"
    )
