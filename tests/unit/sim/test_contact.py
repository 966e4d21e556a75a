"""Legs on the ground: where a vehicle comes to rest, what its accelerometer reads, and where energy goes."""

import math
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from relform_core.units import GRAVITY
from relform_sim.contact import Legs, ground_forces, touches
from relform_sim.plant import Plant
from relform_sim.rigid_body import Body, draw_body, rotation_rows
from support.scenarios import paper_scenario

VEHICLES = {
    name: paper_scenario(f"vehicle=config/vehicles/{name}.yaml").config.vehicle
    for name in ("hummingbird", "crazyflie")
}
LEVEL = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
OFF = (0.0,) * 4


def legs(**changes: float) -> Legs:
    sizes = {"spread": 0.2, "length": 0.1, "stiffness": 700.0, "damping": 6.0, "grip": 25.0}
    return Legs(**(sizes | changes))


def level_state(height: float, velocity: tuple[float, float, float], yaw_rate: float = 0.0) -> Any:
    return (1.0, 2.0, height, *velocity, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, yaw_rate)


def true_body(name: str) -> Body:
    return draw_body(VEHICLES[name], np.random.default_rng(3), has_ground=True)


def plant_of(body: Body, height: float, **state: Any) -> Plant:
    level = {"q_NB": (0.0, 0.0, 0.0, 1.0)}
    return Plant(
        body,
        step=0.005,
        rotor_time_constant=0.0,
        rotor_speed=0.0,
        p_NB_N=(1.0, -2.0, height),
        **(level | state),
    )


def test_force_of_four_compressed_legs_by_hand() -> None:
    """4 legs x 700 N/m x 5 mm, and 60% more at 0.1 m/s downwards."""
    force, torque = ground_forces(legs(), LEVEL, level_state(0.095, (0.0, 0.0, 0.0)))
    assert force == pytest.approx((0.0, 0.0, 14.0))
    assert torque == pytest.approx((0.0, 0.0, 0.0))
    force, _ = ground_forces(legs(), LEVEL, level_state(0.095, (0.0, 0.0, -0.1)))
    assert force == pytest.approx((0.0, 0.0, 14.0 * 1.6))


def test_the_ground_does_not_pull() -> None:
    force, torque = ground_forces(legs(), LEVEL, level_state(0.095, (0.3, 0.0, 0.2)))
    assert force == torque == (0.0, 0.0, 0.0)
    assert not touches(legs(), 0.1, LEVEL)
    assert touches(legs(), 0.099, LEVEL)


def test_one_leg_of_a_tilted_vehicle_by_hand() -> None:
    """Nose down by 30 deg: the front foot at x = 0.2 m is 0.2 sin 30 + 0.1 cos 30 = 0.1866 m below."""
    attitude = Rotation.from_euler("y", math.radians(30.0))
    rows = rotation_rows(tuple(attitude.as_quat().tolist()))
    state = (0.0, 0.0, 0.1766, 0.0, 0.0, 0.0, *attitude.as_quat().tolist(), 0.0, 0.0, 0.0)
    force, torque = ground_forces(legs(), rows, state)
    assert force == pytest.approx((0.0, 0.0, 7.0), abs=0.02)
    # The foot is 0.2 cos 30 - 0.1 sin 30 = 0.1232 m ahead of the origin: the ground lifts the nose.
    assert torque == pytest.approx((0.0, -7.0 * 0.1232, 0.0), abs=0.01)


@pytest.mark.parametrize(("slip", "friction"), [(0.01, 0.9931), (0.084, 5.9397), (5.0, 8.3988)])
def test_friction_approaches_coulombs_limit(slip: float, friction: float) -> None:
    """4 x 25 N s/m at first, then 0.6 x 14 N; where both are 8.4 N, 8.4 N / sqrt(2)."""
    force, _ = ground_forces(legs(), LEVEL, level_state(0.095, (slip * 0.6, -slip * 0.8, 0.0)))
    assert force == pytest.approx((-0.6 * friction, 0.8 * friction, 14.0), abs=1e-4)


def test_friction_stops_a_turn() -> None:
    _, torque = ground_forces(legs(), LEVEL, level_state(0.095, (0.0, 0.0, 0.0), yaw_rate=0.01))
    assert torque == pytest.approx((0.0, 0.0, -4.0 * 25.0 * 0.01 * 0.2**2), rel=1e-3)


@pytest.mark.parametrize("name", VEHICLES)
def test_a_vehicle_stands_at_the_height_of_its_legs_and_reads_gravity(name: str) -> None:
    height = VEHICLES[name].leg_height
    turned = Rotation.from_euler("z", 2.0).as_quat()
    plant = plant_of(true_body(name), height, q_NB=tuple(turned.tolist()))
    for _ in range(20):
        plant.advance(OFF, 0.05)
    truth = plant.odometry(0)
    assert truth.p_NB_N == pytest.approx([1.0, -2.0, height], abs=1e-12)
    assert truth.q_NB == pytest.approx(turned, abs=1e-12)
    assert plant.specific_force() == pytest.approx([0.0, 0.0, GRAVITY], abs=1e-9)
    assert plant.touches_ground


@pytest.mark.parametrize("name", VEHICLES)
@pytest.mark.parametrize("seed", range(10))
def test_a_dropped_vehicle_comes_to_rest_and_loses_energy_all_the_way(name: str, seed: int) -> None:
    """From 0.3 m, tilted by up to 15 deg, turning, and moving sideways."""
    generator = np.random.default_rng(seed)
    axis, turn = generator.uniform(0.0, math.tau, size=2)
    tilt = math.radians(15.0) * generator.uniform()
    attitude = Rotation.from_rotvec(tilt * np.array([math.cos(axis), math.sin(axis), 0.0]))
    attitude = attitude * Rotation.from_euler("z", turn)
    body = true_body(name)
    plant = plant_of(
        body,
        0.3,
        q_NB=tuple(attitude.as_quat().tolist()),
        v_NB_N=(*generator.uniform(-0.5, 0.5, size=2).tolist(), 0.0),
        w_NB_B=tuple(generator.uniform(-0.5, 0.5, size=3).tolist()),
    )
    energies = [energy(body, plant)]
    for _ in range(600):
        plant.advance(OFF, 0.005)
        energies.append(energy(body, plant))
    truth = plant.odometry(0)
    assert truth.p_NB_N[2] == pytest.approx(VEHICLES[name].leg_height, abs=1e-5)
    assert np.linalg.norm(truth.v_NB_B) < 1e-3
    assert np.linalg.norm(truth.w_NB_B) < 1e-2
    assert np.linalg.norm(truth.q_NB[:2]) < 1e-3
    assert np.diff(energies).max() < 1e-3 * energies[0]  # of the integration
    assert plant.specific_force() == pytest.approx([0.0, 0.0, GRAVITY], abs=0.02)


def energy(body: Body, plant: Plant) -> float:
    """Of motion, height and springs [J]."""
    truth = plant.odometry(0)
    assert body.legs is not None
    feet = np.array([(x, y, -body.legs.length) for x, y in body.legs.feet])
    heights = truth.p_NB_N[2] + Rotation.from_quat(truth.q_NB).apply(feet)[:, 2]
    springs = 0.5 * body.legs.stiffness * np.sum(np.minimum(heights, 0.0) ** 2)
    turning = 0.5 * np.sum(np.array(body.inertia) * truth.w_NB_B**2)
    moving = 0.5 * body.mass * np.sum(truth.v_NB_B**2)
    return float(moving + turning + body.mass * GRAVITY * truth.p_NB_N[2] + springs)


def test_a_gust_moves_a_standing_vehicle_by_millimetres() -> None:
    """Friction is regularised: 0.3 N are far below Coulomb's 4 N, and the feet creep."""
    plant = plant_of(true_body("hummingbird"), VEHICLES["hummingbird"].leg_height)
    for _ in range(20):
        plant.advance(OFF, 0.05, wind_N=(0.3, 0.0, 0.0))
    x, y, _ = plant.odometry(0).p_NB_N.tolist()
    assert 0.0 < x - 1.0 < 0.004
    assert y == pytest.approx(-2.0, abs=1e-6)
