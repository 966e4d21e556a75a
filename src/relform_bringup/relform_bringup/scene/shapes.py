"""The shapes that stand for vehicles, links, formation targets, obstacles and names in 3D views."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from enum import IntEnum

import numpy as np

from relform_analysis.plots.style import GUIDE, SHADOW, VEHICLE_COLOURS, cycled
from relform_bringup.scene.poses import LEVEL, Pose, upright
from relform_bringup.scene.urdf import rotor_places
from relform_core.arrays import Array
from relform_core.constraints_config import BoxObstacle, Obstacle, SphereObstacle
from relform_core.rotation import rotation_matrix
from relform_core.scenario_config import ScenarioConfig

NO_POINTS = np.empty((0, 3))
ARM_WIDTH, LINK_WIDTH = 0.02, 0.01
"""[m]."""
NAME_HEIGHT = 0.15
"""Of letters [m]."""


class Kind(IntEnum):
    """Kind of a shape; the numbers of visualization_msgs/Marker."""

    CUBE = 1
    SPHERE = 2
    LINE_LIST = 5
    TEXT_VIEW_FACING = 9


@dataclass(frozen=True, eq=False)
class Shape:
    """One shape in the world."""

    group: str
    """What it stands for; viewers can hide a group."""
    number: int
    """Its own within its group."""
    kind: Kind
    size: tuple[float, float, float]
    """Along x, y, z [m]; of lines only x, the width; of texts only z, the height."""
    colour: str
    """#rrggbb."""
    opacity: float = 1.0
    pose: Pose = field(default_factory=lambda: Pose(np.zeros(3), LEVEL))
    points: Array = field(default_factory=lambda: NO_POINTS)
    """Of lists, in the world [m], shape (point, 3); two for each line."""
    text: str = ""


def vehicle_colour(config: ScenarioConfig, vehicle: str) -> str:
    """The colour of a vehicle in all our pictures, #rrggbb."""
    return cycled(VEHICLE_COLOURS, config.team.vehicles.index(vehicle))


def team_shapes(config: ScenarioConfig, poses: Mapping[str, Pose]) -> Iterator[Shape]:
    """The vehicles with names and collision balls, and lines between those that may see each other.

    Args:
        poses: of those vehicles that are known, by name.
    """
    rotors = np.array([place.p_NB_N for place in rotor_places(config.vehicle).values()])
    ball = (2.0 * config.vehicle.collision_radius,) * 3
    above = np.array([0.0, 0.0, config.vehicle.collision_radius + NAME_HEIGHT])
    for number, vehicle in enumerate(config.team.vehicles):
        if (pose := poses.get(vehicle)) is None:
            continue
        colour = vehicle_colour(config, vehicle)
        front, left, back, right = pose.p_NB_N + rotors @ rotation_matrix(pose.q_NB).T
        arms = np.array([back, front, right, left])
        yield Shape("vehicles", number, Kind.LINE_LIST, (ARM_WIDTH, 0.0, 0.0), colour, points=arms)
        yield Shape("collision", number, Kind.SPHERE, ball, colour, 0.15, pose)
        yield Shape(
            "names", number, Kind.TEXT_VIEW_FACING, (0.0, 0.0, NAME_HEIGHT), colour,
            pose=Pose(pose.p_NB_N + above, LEVEL), text=vehicle,
        )  # fmt: skip
    ends = [poses[name] for pair in _sight_lines(config) if poses.keys() >= set(pair) for name in pair]
    if ends:
        points = np.array([pose.p_NB_N for pose in ends])
        yield Shape("links", 0, Kind.LINE_LIST, (LINK_WIDTH, 0.0, 0.0), GUIDE, 0.6, points=points)


def target_shapes(config: ScenarioConfig, places: Mapping[str, Pose]) -> Iterator[Shape]:
    """A ball where each vehicle should be; ``places`` by vehicle name."""
    size = 0.5 * config.vehicle.arm_length
    for number, vehicle in enumerate(config.team.vehicles):
        if vehicle in places:
            colour = vehicle_colour(config, vehicle)
            yield Shape("targets", number, Kind.SPHERE, (size, size, size), colour, 0.5, pose=places[vehicle])


def obstacle_shapes(config: ScenarioConfig) -> Iterator[Shape]:
    """The obstacles of the scenario."""
    for number, obstacle in enumerate(config.obstacles):
        yield _obstacle_shape(number, obstacle)


def _obstacle_shape(number: int, obstacle: Obstacle) -> Shape:
    center = np.array(obstacle.center)
    match obstacle:
        case SphereObstacle():
            size = (2.0 * obstacle.radius,) * 3
            return Shape("obstacles", number, Kind.SPHERE, size, SHADOW, 0.8, upright(center, 0.0))
        case BoxObstacle():
            return Shape(
                "obstacles", number, Kind.CUBE, obstacle.size, SHADOW, 0.8, upright(center, obstacle.yaw)
            )


def _sight_lines(config: ScenarioConfig) -> list[tuple[str, str]]:
    """Pairs of vehicles that may see each other, each once."""
    order = config.team.vehicles.index
    return [
        (observer, target)
        for observer, targets in config.targets_of.items()
        for target in targets
        if order(observer) < order(target)
    ]
