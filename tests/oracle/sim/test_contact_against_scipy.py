"""Landing on legs against the same forces written with vectors and integrated by SciPy."""

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from relform_sim.contact import Legs
from relform_sim.plant import Plant
from relform_sim.rigid_body import Body

MASS, INERTIA, ARM = 0.72, (0.006, 0.008, 0.013), 0.18
LEGS = Legs.under(MASS, INERTIA, ARM, 0.1)
FEET = np.array([(ARM, 0.0, 0.0), (0.0, ARM, 0.0), (-ARM, 0.0, 0.0), (0.0, -ARM, 0.0)])
FEET -= np.array([0.0, 0.0, LEGS.length])
UP = np.array([0.0, 0.0, 1.0])


def on_a_foot(p_N: Any, v_N: Any) -> Any:
    """Force of the ground in the world frame."""
    depth = max(0.0, -p_N[2])
    normal = max(0.0, LEGS.stiffness * depth * (1.0 - LEGS.damping * v_N[2]))
    slip = v_N - UP * v_N[2]
    limit = 0.6 * normal
    if limit == 0.0:
        return np.zeros(3)
    return normal * UP - slip * LEGS.grip / np.sqrt(1.0 + (LEGS.grip / limit) ** 2 * (slip @ slip))


def land(p_N: Any, v_N: Any, attitude: Rotation, w_B: Any, duration: float, steps: Any) -> Any:
    """Positions, velocities and attitudes at some instants."""

    def rate(t: float, y: Any) -> Any:
        p, v, R, w = y[0:3], y[3:6], y[6:15].reshape(3, 3), y[15:18]
        force, torque = np.zeros(3), np.zeros(3)
        for foot in FEET:
            push = on_a_foot(p + R @ foot, v + R @ np.cross(w, foot))
            force += push
            torque += np.cross(foot, R.T @ push)
        turn = np.array([[0.0, -w[2], w[1]], [w[2], 0.0, -w[0]], [-w[1], w[0], 0.0]])
        inertia = np.array(INERTIA)
        return np.concatenate(
            [v, force / MASS - 9.81 * UP, (R @ turn).ravel(), (torque - np.cross(w, inertia * w)) / inertia]
        )

    initial = np.concatenate([p_N, v_N, attitude.as_matrix().ravel(), w_B])
    solved = solve_ivp(rate, (0.0, duration), initial, t_eval=steps, rtol=1e-9, atol=1e-11, max_step=2e-3)
    return solved.y.T


@pytest.mark.parametrize("seed", range(3))
def test_a_landing_agrees(seed: int) -> None:
    """Half a second from just above the ground, through the impact; 5 ms resolve it to a millimetre."""
    generator = np.random.default_rng(seed)
    attitude = Rotation.from_rotvec([*generator.uniform(-0.15, 0.15, size=2), 0.0])
    attitude = attitude * Rotation.from_euler("z", generator.uniform(-3.0, 3.0))
    p_N = np.array([0.5, -0.3, 0.16])
    v_N = np.array([*generator.uniform(-0.3, 0.3, size=2), -0.5])
    w_B = generator.uniform(-0.5, 0.5, size=3)
    plant = Plant(
        Body(MASS, INERTIA, ARM, 8.5e-6, 1.4e-7, (0.0, 0.0, 0.0), LEGS),
        step=0.005,
        rotor_time_constant=0.0,
        rotor_speed=0.0,
        p_NB_N=tuple(p_N.tolist()),
        q_NB=tuple(attitude.as_quat().tolist()),
        v_NB_N=tuple(v_N.tolist()),
        w_NB_B=tuple(w_B.tolist()),
    )
    steps = np.arange(1, 11) * 0.05
    for expected in land(p_N, v_N, attitude, w_B, 0.5, steps):
        plant.advance((0.0,) * 4, 0.05)
        truth = plant.odometry(0)
        R_NB = expected[6:15].reshape(3, 3)
        assert truth.p_NB_N == pytest.approx(expected[0:3], abs=1e-3)
        assert truth.v_NB_B == pytest.approx(R_NB.T @ expected[3:6], abs=0.02)
        assert Rotation.from_quat(truth.q_NB).as_matrix() == pytest.approx(R_NB, abs=0.01)
        assert truth.w_NB_B == pytest.approx(expected[15:18], abs=0.15)
    assert plant.touches_ground
