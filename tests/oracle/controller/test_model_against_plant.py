"""The prediction model (Euler angles, CasADi) against the plant of the simulator (quaternions, floats)."""

import math

import casadi as ca
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from relform_controller.ocp import layout
from relform_controller.ocp.model import RigidBody, rk4_step
from relform_sim.plant import Plant
from relform_sim.rigid_body import draw_body
from support.scenarios import NOISE_FREE, paper_scenario
from support.states import Array, random_state, random_thrusts

DRAG = "vehicle.drag_coefficient_n_s_m=[0.3, 0.2, 0.1]"
CONFIG = paper_scenario(*NOISE_FREE, DRAG).config  # no uncertainty of mass and inertia
PERIOD = CONFIG.controller.period


def predict(state: Array, thrusts: Array, n_steps: int) -> Array:
    """The state one control period later, in several steps of the model."""
    x, u = ca.SX.sym("x", layout.N_STATE), ca.SX.sym("u", layout.N_INPUT)
    body = RigidBody.from_config(CONFIG.vehicle)
    step = ca.Function("step", [x, u], [rk4_step(x, u, body, PERIOD / n_steps)])
    for _ in range(n_steps):
        state = np.array(step(state, thrusts)).reshape(-1)
    return state


def fly(state: Array, thrusts: Array) -> Array:
    """The same by the plant, in its own fine steps."""
    roll, pitch, yaw = state[layout.RPY]
    plant = Plant(
        draw_body(CONFIG.vehicle, np.random.default_rng(0)),
        step=CONFIG.plant.step,
        rotor_time_constant=0.0,
        rotor_speed=CONFIG.vehicle.hover_speed,
        p_NB_N=tuple(state[layout.POSITION]),
        q_NB=tuple(Rotation.from_euler("ZYX", [yaw, pitch, roll]).as_quat()),
        v_NB_N=tuple(state[layout.VELOCITY]),
        w_NB_B=tuple(state[layout.RATE]),
    )
    speeds = np.sqrt(thrusts / CONFIG.vehicle.thrust_coefficient)
    plant.advance(tuple(speeds.tolist()), PERIOD)
    truth = plant.odometry(50_000_000)
    attitude = Rotation.from_quat(truth.q_NB)
    yaw, pitch, roll = attitude.as_euler("ZYX")
    return np.concatenate([truth.p_NB_N, attitude.apply(truth.v_NB_B), [roll, pitch, yaw], truth.w_NB_B])


def difference(a: Array, b: Array) -> Array:
    delta = a - b
    delta[layout.RPY] = (delta[layout.RPY] + math.pi) % math.tau - math.pi
    return np.abs(delta)


@pytest.mark.parametrize("seed", range(20))
def test_one_period_from_anywhere_in_fine_steps(seed: int) -> None:
    generator = np.random.default_rng(seed)
    state, thrusts = random_state(generator), random_thrusts(generator)
    assert difference(predict(state, thrusts, 50), fly(state, thrusts)).max() < 2e-6


@pytest.mark.parametrize("seed", range(20))
def test_one_period_from_anywhere_in_the_one_step_of_the_controller(seed: int) -> None:
    """The step is as good as its order says: Richardson's estimate from two half steps bounds the error."""
    generator = np.random.default_rng(1000 + seed)
    state, thrusts = random_state(generator), random_thrusts(generator)
    one_step = predict(state, thrusts, 1)
    estimate = difference(one_step, predict(state, thrusts, 2)).max() * 16.0 / 15.0
    assert difference(one_step, fly(state, thrusts)).max() < 1.2 * estimate + 1e-6
    assert estimate < 0.05
