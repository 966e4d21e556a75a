"""The prediction model against a rigid body with a rotation matrix, integrated by SciPy.

The oracle knows where the rotors are, how they turn, and the laws of motion in an inertial frame, but
nothing of Euler angles.
"""

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from relform_controller.ocp import layout
from relform_controller.ocp.model import RigidBody, rk4_step
from support.scenarios import paper_scenario
from support.states import Array, random_state, random_thrusts

VEHICLE = paper_scenario().config.vehicle
ROTOR_POSITIONS_B = VEHICLE.arm_length * np.array([[1.0, 0, 0], [0, 1.0, 0], [-1.0, 0, 0], [0, -1.0, 0]])
CLOCKWISE_SEEN_FROM_ABOVE = np.array([1.0, -1.0, 1.0, -1.0])
"""Of front, left, back, right; the body is turned the other way, positive about z."""


def predict(state: Array, thrusts: Array, period: float) -> Array:
    x, u = ca.SX.sym("x", layout.N_STATE), ca.SX.sym("u", layout.N_INPUT)
    step = ca.Function("step", [x, u], [rk4_step(x, u, RigidBody.from_config(VEHICLE), period)])
    return np.array(step(state, thrusts)).reshape(-1)


def integrate(state: Array, thrusts: Array, period: float) -> tuple[Array, Rotation]:
    """Position, velocity, rates, shape (9,), and attitude after a period, to 1e-12."""
    inertia_B = np.diag(VEHICLE.inertia)
    forces_B = np.outer(thrusts, [0.0, 0.0, 1.0])
    drag_B = VEHICLE.torque_coefficient / VEHICLE.thrust_coefficient * thrusts @ CLOCKWISE_SEEN_FROM_ABOVE
    torque_B = np.cross(ROTOR_POSITIONS_B, forces_B).sum(axis=0) + [0.0, 0.0, drag_B]

    def rate(_: float, y: Array) -> Array:
        v, R, angular_momentum = y[3:6], y[6:15].reshape(3, 3), y[15:18]
        w = R @ np.linalg.solve(inertia_B, R.T @ angular_momentum)  # in the inertial frame
        acceleration = R @ forces_B.sum(axis=0) / VEHICLE.mass - [0.0, 0.0, 9.81]
        return np.concatenate([v, acceleration, np.cross(w, R.T).T.reshape(-1), R @ torque_B])

    roll, pitch, yaw = state[layout.RPY]
    R_IB = Rotation.from_euler("ZYX", [yaw, pitch, roll]).as_matrix()
    start = np.concatenate([state[0:6], R_IB.reshape(-1), R_IB @ inertia_B @ state[layout.RATE]])
    end = solve_ivp(rate, (0.0, period), start, method="DOP853", rtol=1e-12, atol=1e-12).y[:, -1]
    R_IB = end[6:15].reshape(3, 3)
    return np.concatenate([end[0:6], np.linalg.solve(inertia_B, R_IB.T @ end[15:18])]), Rotation.from_matrix(
        R_IB
    )


def error(state: Array, thrusts: Array, period: float) -> float:
    """Largest error of the model in position [m], velocity [m/s], rates [rad/s] and attitude [rad]."""
    predicted, (truth, attitude) = predict(state, thrusts, period), integrate(state, thrusts, period)
    roll, pitch, yaw = predicted[layout.RPY]
    turn = (Rotation.from_euler("ZYX", [yaw, pitch, roll]).inv() * attitude).magnitude()
    return max(float(np.abs(np.delete(predicted, layout.RPY) - truth).max()), float(turn))


@pytest.mark.parametrize("seed", range(12))
def test_one_short_step_from_anywhere(seed: int) -> None:
    generator = np.random.default_rng(seed)
    assert error(random_state(generator), random_thrusts(generator), 0.002) < 1e-9


@pytest.mark.parametrize("seed", range(6))
def test_the_error_falls_with_the_fifth_power_of_the_step(seed: int) -> None:
    """As with the classical Runge-Kutta method: so the equations are the same, and the order is 4."""
    generator = np.random.default_rng(100 + seed)
    state, thrusts = random_state(generator), random_thrusts(generator)
    coarse, fine = error(state, thrusts, 0.02), error(state, thrusts, 0.01)
    assert 22.0 < coarse / fine < 45.0


@pytest.mark.parametrize("seed", range(6))
def test_one_control_period_from_an_ordinary_flight(seed: int) -> None:
    generator = np.random.default_rng(200 + seed)
    state = random_state(generator, rate_max=2.0, tilt_max=0.5)
    assert error(state, random_thrusts(generator, 1.4, 2.2), 0.05) < 2e-4
