"""Rotor forces and rigid body against numbers worked out by hand and conservation laws."""

import math
from pathlib import Path

import numpy as np
import pytest

from relform_core.load import load_scenario
from relform_core.units import GRAVITY
from relform_sim.rigid_body import (
    UNCERTAINTY_LIMIT,
    Body,
    Wrench,
    draw_body,
    rigid_body_rate,
    rotation_rows,
    rotor_wrench,
)

BODY = Body(
    mass=0.8,
    inertia=(0.006, 0.008, 0.011),
    arm_length=0.2,
    thrust_coefficient=1e-5,
    torque_coefficient=2e-7,
    drag_coefficient=(0.0, 0.0, 0.0),
)
VEHICLE = load_scenario(Path(__file__).parents[3] / "config/scenarios/paper.yaml").config.vehicle


@pytest.mark.parametrize(
    ("rotor", "torque"),
    [
        # One rotor at 400 rad/s: 1.6 N at 0.2 m, drag torque 0.032 N m. FLU: x forward, y left, z up.
        pytest.param(0, (0.0, -0.32, 0.032), id="front: nose up is negative pitch"),
        pytest.param(1, (0.32, 0.0, -0.032), id="left: left side up is positive roll"),
        pytest.param(2, (0.0, 0.32, 0.032), id="back: tail up is positive pitch"),
        pytest.param(3, (-0.32, 0.0, -0.032), id="right: right side up is negative roll"),
    ],
)
def test_torque_of_each_rotor(rotor: int, torque: tuple[float, float, float]) -> None:
    speeds = [0.0] * 4
    speeds[rotor] = 400.0
    wrench = rotor_wrench(BODY, tuple(speeds), scale=1.0)
    assert wrench.thrust == pytest.approx(1.6)
    assert wrench.torque == pytest.approx(torque)


def test_scale_acts_on_thrust_and_torque() -> None:
    full = rotor_wrench(BODY, (410.0, 420.0, 430.0, 440.0), scale=1.0)
    less = rotor_wrench(BODY, (410.0, 420.0, 430.0, 440.0), scale=0.9)
    assert less.thrust == pytest.approx(0.9 * full.thrust)
    assert less.torque == pytest.approx([0.9 * component for component in full.torque])


def test_rate_by_hand() -> None:
    # Pitched by +90 deg, nose down: body z points along world x.
    half = math.sqrt(0.5)
    state = (1.0, 2.0, 3.0, 0.4, 0.5, 0.6, 0.0, half, 0.0, half, 2.0, 3.0, 4.0)
    body = Body(**{**BODY.__dict__, "drag_coefficient": (0.1, 0.2, 0.3)})
    rate = rigid_body_rate(body, Wrench(8.0, (0.06, 0.08, 0.11)), (0.16, -0.08, 0.24), state)
    assert rate[0:3] == (0.4, 0.5, 0.6)
    # v_B = (-v_z, v_y, v_x) = (-0.6, 0.5, 0.4); F_B = (0.06, -0.1, 8 - 0.12); F_N = (F_B3, F_B2, -F_B1)
    assert rate[3:6] == pytest.approx(
        ((7.88 + 0.16) / 0.8, (-0.1 - 0.08) / 0.8, (-0.06 + 0.24) / 0.8 - GRAVITY)
    )
    # q' = q * (w, 0) / 2 by hand for q = (0, h, 0, h)
    assert rate[6:10] == pytest.approx(
        (0.5 * half * (2.0 + 4.0), 0.5 * half * 3.0, 0.5 * half * (4.0 - 2.0), -0.5 * half * 3.0)
    )
    # w x I w = (3 * 4 * (0.011 - 0.008), 4 * 2 * (0.006 - 0.011), 2 * 3 * (0.008 - 0.006))
    assert rate[10:13] == pytest.approx(
        ((0.06 - 0.036) / 0.006, (0.08 + 0.04) / 0.008, (0.11 - 0.012) / 0.011)
    )


def test_power_equals_change_of_kinetic_energy_without_gravity_and_drag() -> None:
    state = (0.0, 0.0, 0.0, 1.1, -0.7, 0.3, 0.1, -0.5, 0.3, math.sqrt(0.65), 1.0, -2.0, 3.0)
    wrench = Wrench(6.0, (0.02, -0.03, 0.05))
    rate = rigid_body_rate(BODY, wrench, (0.0, 0.0, 0.0), state)
    R_NB = np.array(rotation_rows(state[6:10]))
    v_N, w_B = np.array(state[3:6]), np.array(state[10:13])
    acceleration_N = np.array(rate[3:6]) - np.array([0.0, 0.0, -GRAVITY])
    change = BODY.mass * v_N @ acceleration_N + w_B @ (np.array(BODY.inertia) * rate[10:13])
    assert change == pytest.approx(v_N @ R_NB @ [0.0, 0.0, wrench.thrust] + w_B @ wrench.torque)


def test_drawn_bodies_scatter_as_specified_and_stay_positive() -> None:
    generator = np.random.default_rng(5)
    bodies = [draw_body(VEHICLE, generator) for _ in range(4000)]
    masses = np.array([body.mass for body in bodies]) / VEHICLE.mass - 1.0
    inertias = np.array([body.inertia for body in bodies]) / VEHICLE.inertia - 1.0
    assert masses.mean() == pytest.approx(0.0, abs=4.0 * 0.01 / math.sqrt(4000))
    assert masses.std() == pytest.approx(0.01, rel=0.05)
    assert inertias.std(axis=0) == pytest.approx([0.05] * 3, rel=0.05)
    assert np.abs(inertias).max() <= UNCERTAINTY_LIMIT * 0.05 + 1e-12
    correlations = np.corrcoef(np.column_stack([masses, inertias]).T)
    assert np.abs(correlations - np.eye(4)).max() < 0.07


def test_a_weak_rotor_gives_less_thrust_and_turns_the_vehicle() -> None:
    """Left has half of its 420^2: it rolls to the left, and turns as the others' drag is not balanced."""
    whole = rotor_wrench(BODY, (410.0, 420.0, 430.0, 440.0), scale=0.9)
    weak = rotor_wrench(BODY, (410.0, 420.0, 430.0, 440.0), 0.9, (1.0, 0.5, 1.0, 1.0))
    lost = 0.9 * 0.5 * 420.0**2
    assert weak.thrust == pytest.approx(whole.thrust - BODY.thrust_coefficient * lost)
    assert weak.torque == pytest.approx(
        (
            whole.torque[0] - BODY.arm_length * BODY.thrust_coefficient * lost,
            whole.torque[1],
            whole.torque[2] + BODY.torque_coefficient * lost,
        )
    )
