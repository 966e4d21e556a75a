"""A model of a vehicle in the Unified Robot Description Format, made from its configuration."""

import math
from collections.abc import Mapping
from xml.etree import ElementTree

import numpy as np

from relform_bringup.scene.poses import LEVEL, Pose
from relform_core.arrays import Array
from relform_core.vehicle_config import VehicleConfig

ROTORS = {"front": (1.0, 0.0), "left": (0.0, 1.0), "back": (-1.0, 0.0), "right": (0.0, -1.0)}
"""Direction of each arm in the body frame, in the order of the rotor speeds (eq. Aerodynamics)."""
ROTOR_RADIUS = 0.6
"""Of a drawn rotor, as a share of the arm's length; the drawn ones do not touch below 0.71."""
THICKNESS = 0.08
"""Of arms and rotors, likewise."""
HUB_RADIUS = 0.25
"""Likewise."""
NOSE_COLOUR = "#E69F00"
"""Of the front rotor."""


def rotor_frame(vehicle: str, rotor: str) -> str:
    """Frame id of a rotor of a vehicle."""
    return f"{vehicle}/rotor_{rotor}"


def rotor_places(config: VehicleConfig) -> dict[str, Pose]:
    """Pose of each rotor in the body frame, by its name."""
    return {
        rotor: Pose(np.array([config.arm_length * x, config.arm_length * y, 0.0]), LEVEL)
        for rotor, (x, y) in ROTORS.items()
    }


def robot_description(vehicle: str, body_frame: str, config: VehicleConfig, colour: str) -> str:
    """The model as XML.

    Its links have the names of the frames on /tf, so that viewers need no prefix.

    Args:
        vehicle: its name.
        body_frame: frame id of its body.
        colour: of its hub, #rrggbb.
    """
    robot = ElementTree.Element("robot", name=vehicle)
    _add_body(robot, body_frame, config, colour)
    for rotor, place in rotor_places(config).items():
        frame = rotor_frame(vehicle, rotor)
        link = ElementTree.SubElement(robot, "link", name=frame)
        disc = {"radius": ROTOR_RADIUS * config.arm_length, "length": THICKNESS * config.arm_length}
        _add_visual(link, "cylinder", disc, NOSE_COLOUR if rotor == "front" else "#8A8A8A", opacity=0.6)
        joint = ElementTree.SubElement(robot, "joint", name=f"{frame}_joint", type="fixed")
        ElementTree.SubElement(joint, "parent", link=body_frame)
        ElementTree.SubElement(joint, "child", link=frame)
        ElementTree.SubElement(joint, "origin", xyz=_numbers(place.p_NB_N), rpy="0 0 0")
    ElementTree.indent(robot)
    return ElementTree.tostring(robot, encoding="unicode", xml_declaration=True)


def _add_body(robot: ElementTree.Element, frame: str, config: VehicleConfig, colour: str) -> None:
    """Mass, hub, arms, and the ball that must not touch that of another vehicle."""
    arm = config.arm_length
    link = ElementTree.SubElement(robot, "link", name=frame)
    inertial = ElementTree.SubElement(link, "inertial")
    ElementTree.SubElement(inertial, "mass", value=_number(config.mass))
    moments = dict(zip(("ixx", "iyy", "izz"), map(_number, config.inertia), strict=True))
    ElementTree.SubElement(inertial, "inertia", moments | {"ixy": "0", "ixz": "0", "iyz": "0"})
    hub = {"radius": HUB_RADIUS * arm, "length": 2.0 * THICKNESS * arm}
    _add_visual(link, "cylinder", hub, colour)
    for yaw in (0.0, 0.5 * math.pi):
        beam = {"size": np.array([2.0, THICKNESS, THICKNESS]) * arm}
        _add_visual(link, "box", beam, "#555555", yaw=yaw)
    collision = ElementTree.SubElement(link, "collision")
    _add_geometry(collision, "sphere", {"radius": config.collision_radius})


def _add_visual(
    link: ElementTree.Element,
    shape: str,
    sizes: Mapping[str, float | Array],
    colour: str,
    opacity: float = 1.0,
    yaw: float = 0.0,
) -> None:
    visual = ElementTree.SubElement(link, "visual")
    ElementTree.SubElement(visual, "origin", xyz="0 0 0", rpy=_numbers(np.array([0.0, 0.0, yaw])))
    _add_geometry(visual, shape, sizes)
    material = ElementTree.SubElement(visual, "material", name=f"{colour} {opacity:g}")
    ElementTree.SubElement(material, "color", rgba=_numbers(np.array([*red_green_blue(colour), opacity])))


def _add_geometry(parent: ElementTree.Element, shape: str, sizes: Mapping[str, float | Array]) -> None:
    geometry = ElementTree.SubElement(parent, "geometry")
    ElementTree.SubElement(
        geometry, shape, {key: _numbers(np.atleast_1d(size)) for key, size in sizes.items()}
    )


def red_green_blue(colour: str) -> tuple[float, float, float]:
    """Parts from 0 to 1 of a colour #rrggbb."""
    red, green, blue = bytes.fromhex(colour.removeprefix("#"))
    return red / 255.0, green / 255.0, blue / 255.0


def _numbers(values: Array) -> str:
    return " ".join(map(_number, values.tolist()))


def _number(value: float) -> str:
    return f"{value:.9g}"
