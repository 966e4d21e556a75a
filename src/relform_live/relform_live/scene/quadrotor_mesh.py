"""A simple quadrotor as triangles, for arms of length one: {b} is x forward, y left, z up."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from relform_core.arrays import Array

SIDES = 20
"""Of a rotor's disc."""
ROTOR_RADIUS = 0.56
ARM_WIDTH = 0.11
BODY = (0.62, 0.4, 0.2)
NOSE = (0.2, 0.16, 0.1)
ROTOR_HEIGHT = 0.17


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles; the outside is where their corners turn counterclockwise."""

    vertices: Array
    """Shape (vertex, 3)."""
    faces: npt.NDArray[np.uint32]
    """Indices of vertices, shape (face, 3)."""

    @classmethod
    def joined(cls, *meshes: "Mesh") -> "Mesh":
        """Several meshes as one."""
        offsets = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes[:-1])])
        faces = [mesh.faces + offset for mesh, offset in zip(meshes, offsets, strict=True)]
        vertices = np.concatenate([mesh.vertices for mesh in meshes])
        return cls(vertices, np.concatenate(faces).astype(np.uint32))


def box(center: tuple[float, float, float], size: tuple[float, float, float]) -> Mesh:
    """A box along the axes."""
    corners = np.array([(x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
    faces = [
        (0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1),
        (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3),
    ]  # fmt: skip
    return Mesh(np.array(center) + corners * np.array(size), np.array(faces, dtype=np.uint32))


def disc(center: tuple[float, float, float], radius: float, height: float) -> Mesh:
    """An upright cylinder."""
    angles = 2.0 * np.pi / SIDES * np.arange(SIDES)
    rim = np.stack([radius * np.cos(angles), radius * np.sin(angles)], axis=1)
    low = np.concatenate([rim, np.full((SIDES, 1), -0.5 * height)], axis=1)
    high = np.concatenate([rim, np.full((SIDES, 1), 0.5 * height)], axis=1)
    vertices = np.concatenate([low, high, [[0.0, 0.0, -0.5 * height], [0.0, 0.0, 0.5 * height]]])
    faces = []
    for this in range(SIDES):
        following = (this + 1) % SIDES
        faces += [(this, following, SIDES + following), (this, SIDES + following, SIDES + this)]
        faces += [(following, this, 2 * SIDES), (SIDES + this, SIDES + following, 2 * SIDES + 1)]
    return Mesh(np.array(center) + vertices, np.array(faces, dtype=np.uint32))


def frame() -> Mesh:
    """Body, arms and motors; a nose shows where the front is."""
    arms = (
        box((0.0, 0.0, 0.0), (2.0, ARM_WIDTH, ARM_WIDTH)),
        box((0.0, 0.0, 0.0), (ARM_WIDTH, 2.0, ARM_WIDTH)),
    )
    motors = [disc((x, y, 0.5 * ROTOR_HEIGHT), 0.1, ROTOR_HEIGHT) for x, y in _rotors()]
    nose = box((0.5 * BODY[0] + 0.5 * NOSE[0], 0.0, 0.03), NOSE)
    return Mesh.joined(box((0.0, 0.0, 0.04), BODY), nose, *arms, *motors)


def rotors() -> Mesh:
    """The discs that the rotors cover."""
    return Mesh.joined(*(disc((x, y, ROTOR_HEIGHT + 0.02), ROTOR_RADIUS, 0.03) for x, y in _rotors()))


def _rotors() -> tuple[tuple[float, float], ...]:
    """Front, left, back, right."""
    return (1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)
