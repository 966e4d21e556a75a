"""The 3D scene in the browser. Its nodes are made once per flight; frames only change their values."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import viser

from relform_core.arrays import Array
from relform_core.constraints_config import BoxObstacle, Obstacle, SphereObstacle
from relform_core.rotation import quaternion_from_yaw
from relform_live.scene import colours, quadrotor_mesh
from relform_live.scene.quadrotor_mesh import Mesh
from relform_live.scene.stage import AHEAD_POINTS, Picture, Poses, Stage
from relform_live.scene.trail import Trail

ROOT = "/flight"
ARM_MIN = 0.12
"""Smaller vehicles are drawn with arms of this length [m], so that they can be seen."""
LABEL_HEIGHT = 0.22
"""Of a name above its vehicle [m]."""
TARGET_RADIUS = 0.05
AHEAD_COLOUR = (236, 190, 90)
HEIGHT_COLOUR = (110, 118, 128)
GROUND_M = 400.0
TRAIL_EVERY = 3
"""Frames between two updates of the trails, which are long; the tips close the gap in every frame."""


@dataclass
class Shown:
    """What the user wants to see."""

    truth: bool = True
    estimate: bool = True
    trails: bool = True
    links: bool = True
    targets: bool = True
    names: bool = True
    follow: bool = True


class World:
    """The scene of one flight.

    The team stays near the origin of the browser's scene, where the camera looks: to follow the team, the
    whole flight moves, with its ground.
    """

    def __init__(
        self, server: viser.ViserServer, stage: Stage, obstacles: tuple[Obstacle, ...], arm: float
    ) -> None:
        """Make the nodes.

        Args:
            arm: length of the vehicles' arms [m].
        """
        self.shown = Shown()
        self._stage = stage
        self._frame = 0
        scene, n = server.scene, len(stage.vehicles)
        scene.configure_default_lights(cast_shadow=False)  # shadows take most of the time of a frame
        self._root = scene.add_frame(ROOT, show_axes=False)
        _add_ground(scene)
        for index, obstacle in enumerate(obstacles):
            _add_obstacle(scene, f"{ROOT}/obstacles/{index}", obstacle)
        size = max(arm, ARM_MIN)
        frame, rotors = quadrotor_mesh.frame(), quadrotor_mesh.rotors()
        self._truth, self._estimate, self._labels = [], [], []
        for name, colour in zip(stage.vehicles, stage.colours, strict=True):
            rgb = (int(colour[0]), int(colour[1]), int(colour[2]))
            truth, ghost = f"{ROOT}/truth/{name}", f"{ROOT}/estimate/{name}"
            self._truth.append(scene.add_frame(truth, show_axes=False, visible=False))
            _add_mesh(scene, f"{truth}/frame", frame, size, rgb, opacity=None)
            _add_mesh(scene, f"{truth}/rotors", rotors, size, rgb, opacity=0.45)
            self._estimate.append(scene.add_frame(ghost, show_axes=False, visible=False))
            _add_mesh(scene, f"{ghost}/frame", frame, size, rgb, opacity=0.3)
            self._labels.append(
                scene.add_label(f"{ROOT}/names/{name}", name, anchor="bottom-center", visible=False)
            )
        trail = Trail().segments
        self._trails = [
            scene.add_line_segments(
                f"{ROOT}/trails/{name}", trail, colour, thickness=2.0, thickness_units="screen", visible=False
            )
            for name, colour in zip(stage.vehicles, stage.colours, strict=True)
        ]
        self._tips = scene.add_line_segments(
            f"{ROOT}/trails/tips", np.zeros((n, 2, 3)), _of_ends(stage.colours),
            thickness=2.0, thickness_units="screen", visible=False,
        )  # fmt: skip
        self._heights = scene.add_line_segments(
            f"{ROOT}/heights", np.zeros((n, 2, 3)), HEIGHT_COLOUR,
            thickness=1.0, thickness_units="screen", visible=False,
        )  # fmt: skip
        self._links = scene.add_line_segments(
            f"{ROOT}/links", np.zeros((len(stage.edges), 2, 3)),
            np.zeros((len(stage.edges), 2, 3), dtype=np.uint8),
            thickness=1.5, thickness_units="screen", visible=False,
        )  # fmt: skip
        self._ahead = scene.add_line_segments(
            f"{ROOT}/ahead", np.zeros((AHEAD_POINTS // 2, 2, 3)), AHEAD_COLOUR,
            thickness=2.0, thickness_units="screen", visible=False,
        )  # fmt: skip
        self._targets = [
            scene.add_icosphere(
                f"{ROOT}/targets/{name}", TARGET_RADIUS, color=tuple(colour), opacity=0.6, subdivisions=1,
                visible=False,
            )
            for name, colour in zip(stage.vehicles, stage.colours.tolist(), strict=True)
        ]  # fmt: skip

    def remove(self) -> None:
        """Take the flight out of the scene."""
        self._root.remove()

    def draw(self, picture: Picture) -> None:
        """Show a picture."""
        truth, shown = picture.truth, self.shown
        _place(self._truth, truth if shown.truth else None)
        _place(self._estimate, picture.estimate if shown.estimate else None)
        for index, target in enumerate(self._targets):
            target.visible = shown.targets and picture.targets is not None
            if picture.targets is not None:
                target.position = picture.targets[index]
        self._ahead.visible = shown.targets and picture.targets is not None
        if self._ahead.visible:
            self._ahead.points = single(picture.ahead.reshape(-1, 2, 3))  # every other piece: a dashed line
        self._draw_links(picture)
        self._draw_trails(picture)
        leading = truth or picture.estimate
        for index, label in enumerate(self._labels):
            label.visible = shown.names and leading is not None
            if leading is not None and shown.names:
                label.position = leading.p_NB_N[index] + (0.0, 0.0, LABEL_HEIGHT)
        self._heights.visible = truth is not None and shown.truth
        if truth is not None:
            on_ground = truth.p_NB_N * (1.0, 1.0, 0.0)
            self._heights.points = single(np.stack([truth.p_NB_N, on_ground], axis=1))
        self._follow(leading)
        self._frame += 1

    def _draw_links(self, picture: Picture) -> None:
        links = picture.links if self.shown.links else None
        self._links.visible = links is not None
        if links is not None:
            self._links.points = single(links.segments)
            self._links.colors = _of_ends(links.colours)

    def _draw_trails(self, picture: Picture) -> None:
        places = None if picture.truth is None or not self.shown.trails else picture.truth.p_NB_N
        visible = self._tips.visible = places is not None
        for vehicle, node in zip(self._stage.vehicles, self._trails, strict=True):
            node.visible = visible
            if visible and self._frame % TRAIL_EVERY == 0:
                node.points = single(self._stage.trails[vehicle].segments)
        if places is not None:
            ends = [node.points[-1, 1] for node in self._trails]
            self._tips.points = single(np.stack([ends, places], axis=1))

    def _follow(self, poses: Poses | None) -> None:
        if poses is None or not self.shown.follow:
            return
        self._root.position = -poses.p_NB_N.mean(axis=0)


def _place(nodes: Sequence[viser.FrameHandle], poses: Poses | None) -> None:
    for index, node in enumerate(nodes):
        node.visible = poses is not None
        if poses is not None:
            node.position = poses.p_NB_N[index]
            node.wxyz = poses.wxyz_NB[index]


def _add_mesh(
    scene: viser.SceneApi, name: str, mesh: Mesh, arm: float, colour: colours.Rgb, opacity: float | None
) -> None:
    scene.add_mesh_simple(
        name, arm * mesh.vertices, mesh.faces, color=colour, opacity=opacity, flat_shading=True,
    )  # fmt: skip


def single(values: Array) -> npt.NDArray[np.float32]:
    """The same numbers as the browser gets them."""
    return values.astype(np.float32)


def _of_ends(of_lines: colours.Colours) -> colours.Colours:
    """Colours for both ends of each line, shape (line, 2, 3): the browser takes them as linear."""
    return np.repeat(colours.linear(of_lines)[:, None], 2, axis=1)


def _add_ground(scene: viser.SceneApi) -> None:
    scene.add_grid(
        f"{ROOT}/ground", GROUND_M, GROUND_M, cell_size=0.5, section_size=5.0, cell_color=(90, 96, 104),
        section_color=(110, 118, 128), cell_thickness=0.6, section_thickness=1.0, fade_distance=60.0,
    )  # fmt: skip


def _add_obstacle(scene: viser.SceneApi, name: str, obstacle: Obstacle) -> None:
    colour = (176, 96, 70)
    match obstacle:
        case SphereObstacle():
            scene.add_icosphere(name, obstacle.radius, color=colour, opacity=0.8, position=obstacle.center)
        case BoxObstacle():
            scene.add_box(
                name, color=colour, dimensions=obstacle.size, opacity=0.8, position=obstacle.center,
                wxyz=np.roll(quaternion_from_yaw(obstacle.yaw), 1),
            )  # fmt: skip
