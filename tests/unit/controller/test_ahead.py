"""The team is predicted over the time that commands need to arrive, into the frames at its end."""

import dataclasses
import math

import numpy as np
import pytest

from relform_controller.ahead import predict_ahead
from relform_controller.ocp import layout
from relform_controller.ocp.problem import Disturbances, Ocp, TeamGeometry
from relform_controller.solver.prediction import predictor
from relform_core.arrays import Array
from support.scenarios import paper_scenario

CONFIG = paper_scenario().config
OCP = dataclasses.replace(Ocp.from_config(CONFIG), is_disturbed=True)
PREDICT = predictor(OCP)
HOVER = np.full((3, 4), CONFIG.vehicle.hover_thrust)
GEOMETRY = TeamGeometry(
    p_I1I2_I1=np.array([[-1, -0.5, 0.3], [-1, 0.5, 0], [1, 0.2, 0], [0, 1, 0], [1, -0.2, 0], [0, -1, 0.0]]),
    yaw_I1I2=np.array([0.5, -0.4, -0.5, -0.9, 0.4, 0.9]),
    p_NI_N=np.array([3.0, -2.0, 5.0]),
    yaw_NI=math.pi / 2,
    disturbances=Disturbances(np.zeros((3, 3)), np.ones(3)),
)


def moving(*velocities: tuple[float, float, float]) -> Array:
    states = np.zeros((3, layout.N_STATE))
    states[:, layout.VELOCITY] = velocities
    return states


def test_a_team_in_uniform_motion() -> None:
    """Two intervals of 0.05 s; the followers' velocities are in their own frames."""
    states = moving((2.0, 1.0, 0.0), (0.0, 0.0, -1.0), (1.0, 0.0, 0.0))
    ahead = predict_ahead(states, GEOMETRY, [HOVER, HOVER], PREDICT, OCP.pairs)
    np.testing.assert_allclose(ahead.states, states, atol=1e-9)
    places = ahead.geometry.p_I1I2_I1
    # The leader moves by (0.2, 0.1), follower 1 down by 0.1, follower 2 by 0.1 along its x, turned by -0.4.
    np.testing.assert_allclose(places[0], [-1.2, -0.6, 0.2], atol=1e-9)
    x, y = -1.0 + 0.1 * math.cos(0.4) - 0.2, 0.5 - 0.1 * math.sin(0.4) - 0.1
    np.testing.assert_allclose(places[1], [x, y, 0.0], atol=1e-9)
    np.testing.assert_allclose(ahead.geometry.p_NI_N, [3.0 - 0.1, -2.0 + 0.2, 5.0], atol=1e-9)
    assert ahead.geometry.yaw_NI == pytest.approx(math.pi / 2)


def test_frames_turn_with_their_vehicles() -> None:
    """The leader turns by 0.1 rad in 0.1 s, and so does what it sees, and a force in its frame."""
    states = moving((1.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    states[0, layout.RATE] = [0.0, 0.0, 1.0]
    pushed = Disturbances(np.array([[0.5, 0, 0], [0, 0, 0], [0, 0, 0.0]]), np.ones(3))
    geometry = dataclasses.replace(GEOMETRY, disturbances=pushed)
    ahead = predict_ahead(states, geometry, [HOVER, HOVER], PREDICT, OCP.pairs)
    c, s = math.cos(0.1), math.sin(0.1)
    moved = 0.1 + 0.5 * 0.5 * 0.1**2
    x, y = -1.0 - moved, -0.5
    np.testing.assert_allclose(ahead.geometry.p_I1I2_I1[0], [c * x + s * y, c * y - s * x, 0.3], atol=1e-9)
    np.testing.assert_allclose(ahead.states[0, layout.VELOCITY], [1.05 * c, -1.05 * s, 0.0], atol=1e-9)
    assert ahead.states[0, layout.YAW] == pytest.approx(0.0, abs=1e-12)
    assert ahead.geometry.yaw_NI == pytest.approx(math.pi / 2 + 0.1)
    np.testing.assert_allclose(ahead.geometry.yaw_I1I2, GEOMETRY.yaw_I1I2 + [-0.1, -0.1, 0.1, 0, 0.1, 0])
    assert ahead.geometry.disturbances is not None
    np.testing.assert_allclose(
        ahead.geometry.disturbances.acceleration_I[0], [0.5 * c, -0.5 * s, 0.0], atol=1e-12
    )


def test_two_steps_are_one_step_twice() -> None:
    generator = np.random.default_rng(3)
    states = 0.3 * generator.standard_normal((3, layout.N_STATE))
    states[:, layout.POSITION] = states[:, layout.YAW] = 0.0
    disturbances = Disturbances(0.5 * generator.standard_normal((3, 3)), np.array([0.9, 1.0, 1.1]))
    geometry = dataclasses.replace(GEOMETRY, disturbances=disturbances)
    thrusts = [HOVER * generator.uniform(0.7, 1.3, (3, 4)) for _ in range(2)]
    at_once = predict_ahead(states, geometry, thrusts, PREDICT, OCP.pairs)
    half = predict_ahead(states, geometry, thrusts[:1], PREDICT, OCP.pairs)
    whole = predict_ahead(half.states, half.geometry, thrusts[1:], PREDICT, OCP.pairs)
    np.testing.assert_allclose(whole.states, at_once.states, atol=1e-12)
    np.testing.assert_allclose(whole.geometry.p_I1I2_I1, at_once.geometry.p_I1I2_I1, atol=1e-12)
    np.testing.assert_allclose(whole.geometry.yaw_I1I2, at_once.geometry.yaw_I1I2, atol=1e-12)
    np.testing.assert_allclose(whole.geometry.p_NI_N, at_once.geometry.p_NI_N, atol=1e-12)
