"""The plant against the same physics written with rotation matrices and integrated by SciPy."""

import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from relform_sim.plant import Plant
from relform_sim.rigid_body import Body

MASS, INERTIA = 0.715, np.diag([0.0068, 0.0073, 0.0118])
ARM, C_T, C_Q = 0.18, 8.54858e-6, 1.3678e-7
DRAG = np.diag([0.25, 0.3, 0.1])
ROTOR_POSITIONS = ARM * np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
REACTIONS = np.array([1.0, -1.0, 1.0, -1.0])
"""About body z, per rotor: front and back turn clockwise seen from above and push the body the other way."""


def skew(v: Any) -> Any:
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])


def fly(
    p_N: Any,
    v_N: Any,
    R_NB: Any,
    w_B: Any,
    start: Any,
    command: Any,
    lag: float,
    duration: float,
    wind_N: Any,
    scale: float,
) -> Any:
    """Newton and Euler with R' = R [w]x; thrusts at the positions of the rotors."""

    def rate(t: float, y: Any) -> Any:
        v, R, w = y[3:6], y[6:15].reshape(3, 3), y[15:18]
        speeds = command if lag == 0.0 else y[18:22]
        thrusts = np.outer(scale * C_T * speeds**2, [0.0, 0.0, 1.0])
        force_B = thrusts.sum(axis=0) - DRAG @ R.T @ v
        torque_B = np.cross(ROTOR_POSITIONS, thrusts).sum(axis=0)
        torque_B[2] += REACTIONS @ (scale * C_Q * speeds**2)
        speed_rate = np.zeros(4) if lag == 0.0 else (command - speeds) / lag
        return np.concatenate(
            [
                v,
                np.array([0.0, 0.0, -9.81]) + (R @ force_B + wind_N) / MASS,
                (R @ skew(w)).ravel(),
                np.linalg.solve(INERTIA, torque_B - skew(w) @ INERTIA @ w),
                speed_rate,
            ]
        )

    initial = np.concatenate([p_N, v_N, R_NB.ravel(), w_B, start])
    return solve_ivp(rate, (0.0, duration), initial, method="DOP853", rtol=1e-11, atol=1e-12).y[:, -1]


@pytest.mark.parametrize("lag", [0.0, 0.03])
@pytest.mark.parametrize("seed", range(4))
def test_plant_agrees(seed: int, lag: float) -> None:
    generator = np.random.default_rng(seed)
    attitude = Rotation.random(random_state=seed)
    p_N, v_N, wind_N = generator.normal(size=(3, 3))
    w_B = 3.0 * generator.normal(size=3)
    start_speed = 420.0
    command = generator.uniform(380.0, 520.0, size=4)
    scale = generator.uniform(0.8, 1.1)
    plant = Plant(
        Body(MASS, tuple(np.diag(INERTIA).tolist()), ARM, C_T, C_Q, tuple(np.diag(DRAG).tolist())),
        step=0.005,
        rotor_time_constant=lag,
        rotor_speed=start_speed,
        p_NB_N=tuple(p_N.tolist()),
        q_NB=tuple(attitude.as_quat().tolist()),
        v_NB_N=tuple(v_N.tolist()),
        w_NB_B=tuple(w_B.tolist()),
    )
    duration = 0.3
    plant.advance(tuple(command.tolist()), duration, wind_N=tuple(wind_N.tolist()), thrust_scale=scale)
    truth = plant.odometry(0)

    expected = fly(
        p_N, v_N, attitude.as_matrix(), w_B, np.full(4, start_speed), command, lag, duration, wind_N, scale
    )
    R_NB = expected[6:15].reshape(3, 3)
    assert truth.p_NB_N == pytest.approx(expected[0:3], abs=1e-7)
    assert truth.v_NB_B == pytest.approx(R_NB.T @ expected[3:6], abs=1e-5)
    assert Rotation.from_quat(truth.q_NB).as_matrix() == pytest.approx(R_NB, abs=1e-6)
    assert truth.w_NB_B == pytest.approx(expected[15:18], abs=1e-5)
    assert math.dist(expected[15:18], w_B) > 0.5  # it was a flight worth comparing
