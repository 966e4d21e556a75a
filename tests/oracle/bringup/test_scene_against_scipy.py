"""Poses against scipy.spatial.transform, and the model of a vehicle as an XML parser reads it."""

import math
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from relform_bringup.scene.poses import estimated_poses, tilt_of
from relform_bringup.scene.urdf import robot_description, rotor_places
from relform_core.load import load_scenario
from relform_core.telemetry import LeaderEstimate, PairEstimate, TeamState
from support.scenarios import PAPER

angles = st.floats(-math.pi, math.pi)
tilts = st.floats(-1.4, 1.4)
places = st.tuples(*[st.floats(-50.0, 50.0)] * 3).map(np.array)


@given(angles, tilts, angles)
def test_a_tilt_has_roll_and_pitch_alone(roll: float, pitch: float, yaw: float) -> None:
    attitude = Rotation.from_euler("ZYX", [yaw, pitch, roll])
    tilt = Rotation.from_quat(tilt_of(attitude.as_quat()))
    wanted = Rotation.from_euler("ZYX", [0.0, pitch, roll])
    assert tilt.as_matrix() == pytest.approx(wanted.as_matrix(), abs=1e-9)


@given(places, angles, places, angles, tilts, tilts, angles)
def test_a_follower_is_composed_as_scipy_does(
    p_leader: np.ndarray,
    yaw_leader: float,
    p_pair: np.ndarray,
    yaw_pair: float,
    roll: float,
    pitch: float,
    yaw_of_imu: float,
) -> None:
    pair = PairEstimate("leader", "wing", p_pair, np.zeros(3), yaw_pair, 0.01, False)
    state = TeamState("A", (pair,), 0.0, 0.0, LeaderEstimate(p_leader, yaw_leader, None))
    imu = Rotation.from_euler("ZYX", [yaw_of_imu, pitch, roll]).as_quat()
    wing = estimated_poses(state, {"wing": imu}, "leader")["wing"]
    R_NC = Rotation.from_euler("Z", yaw_leader)
    assert wing.p_NB_N == pytest.approx(p_leader + R_NC.apply(p_pair), abs=1e-9)
    R_NB = R_NC * Rotation.from_euler("Z", yaw_pair) * Rotation.from_euler("YX", [pitch, roll])
    assert Rotation.from_quat(wing.q_NB).as_matrix() == pytest.approx(R_NB.as_matrix(), abs=1e-9)


@pytest.mark.parametrize("vehicle", ["hummingbird", "crazyflie"])
def test_a_model_has_the_mass_inertia_and_size_of_its_configuration(vehicle: str) -> None:
    config = load_scenario(PAPER, (f"vehicle={vehicle}",)).config.vehicle
    robot = ElementTree.fromstring(robot_description("wing", "wing/base_link", config, "#D55E00"))
    links = {link.get("name"): link for link in robot.findall("link")}
    assert list(links) == ["wing/base_link", *(f"wing/rotor_{each}" for each in rotor_places(config))]
    body = links["wing/base_link"]
    assert float(body.find("inertial/mass").attrib["value"]) == pytest.approx(config.mass)
    moments = {key: float(value) for key, value in body.find("inertial/inertia").attrib.items()}
    tensor = [[moments[f"i{min(i, j)}{max(i, j)}"] for j in "xyz"] for i in "xyz"]
    assert np.array(tensor) == pytest.approx(np.diag(config.inertia))
    radius = float(body.find("collision/geometry/sphere").attrib["radius"])
    assert radius == pytest.approx(config.collision_radius)
    assert all(link.find("inertial") is None for name, link in links.items() if name != "wing/base_link")


@pytest.mark.parametrize("vehicle", ["hummingbird", "crazyflie"])
def test_rotors_are_where_their_thrust_acts(vehicle: str) -> None:
    """The torque of one rotor's thrust about body x and y, as eq. Aerodynamics has it."""
    config = load_scenario(PAPER, (f"vehicle={vehicle}",)).config.vehicle
    robot = ElementTree.fromstring(robot_description("wing", "wing/base_link", config, "#D55E00"))
    joints = robot.findall("joint")
    assert [joint.get("type") for joint in joints] == ["fixed"] * 4
    assert {joint.find("parent").attrib["link"] for joint in joints} == {"wing/base_link"}
    places = [np.array(joint.find("origin").attrib["xyz"].split(), dtype=float) for joint in joints]
    torques = np.array([np.cross(place, [0.0, 0.0, 1.0]) for place in places]) / config.arm_length
    assert pytest.approx(np.array([[0, 1, 0, -1], [-1, 0, 1, 0]], dtype=float)) == torques[:, :2].T
    assert np.array(places) == pytest.approx(
        np.array([pose.p_NB_N for pose in rotor_places(config).values()])
    )
