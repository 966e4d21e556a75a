"""The plant in time: free fall, conservation laws, order of convergence, rotor lag, disturbances."""

import itertools
import math
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from relform_core.units import GRAVITY
from relform_sim.plant import Plant
from relform_sim.rigid_body import Body
from support.bodies import BODY

TILTED = tuple(Rotation.from_euler("ZYX", [1.0, 0.4, -0.3]).as_quat().tolist())
NO_SPEED = (0.0, 0.0, 0.0, 0.0)
UNEVEN = (440.0, 465.0, 455.0, 430.0)


def make_plant(body: Body = BODY, **changes: Any) -> Plant:
    settings: dict[str, Any] = {
        "step": 0.005,
        "rotor_time_constant": 0.0,
        "rotor_speed": 450.0,
        "p_NB_N": (1.0, -2.0, 3.0),
        "q_NB": TILTED,
        "v_NB_N": (0.5, -0.4, 2.0),
        "w_NB_B": (3.0, -2.0, 4.0),
    }
    return Plant(body, **{**settings, **changes})


def state(plant: Plant) -> np.ndarray[Any, np.dtype[np.float64]]:
    truth = plant.odometry(0)
    return np.concatenate([truth.p_NB_N, truth.q_NB, truth.v_NB_B, truth.w_NB_B])


def test_odometry_returns_the_initial_state() -> None:
    truth = make_plant().odometry(150_000_000)
    assert truth.stamp_ns == 150_000_000
    assert truth.p_NB_N.tolist() == [1.0, -2.0, 3.0]
    assert truth.q_NB == pytest.approx(TILTED)
    assert truth.v_NB_B == pytest.approx(Rotation.from_quat(TILTED).inv().apply([0.5, -0.4, 2.0]))
    assert truth.w_NB_B.tolist() == [3.0, -2.0, 4.0]
    assert not truth.pose_covariance.any()
    assert not truth.twist_covariance.any()


def test_free_fall_and_conservation_without_thrust() -> None:
    plant = make_plant()
    inertia = np.array(BODY.inertia)

    def momentum_and_energy() -> tuple[Any, float]:
        truth = plant.odometry(0)
        momentum_B = inertia * truth.w_NB_B
        kinetic = 0.5 * BODY.mass * truth.v_NB_B @ truth.v_NB_B + 0.5 * truth.w_NB_B @ momentum_B
        return Rotation.from_quat(truth.q_NB).apply(momentum_B), kinetic + BODY.mass * GRAVITY * truth.p_NB_N[
            2
        ]

    momentum_N, energy = momentum_and_energy()
    w_NB_B = plant.odometry(0).w_NB_B
    plant.advance(NO_SPEED, 2.0)
    truth = plant.odometry(0)

    assert truth.p_NB_N == pytest.approx(
        [1.0 + 0.5 * 2.0, -2.0 - 0.4 * 2.0, 3.0 + 2.0 * 2.0 - 0.5 * GRAVITY * 4.0]
    )
    assert not np.allclose(truth.w_NB_B, w_NB_B, atol=0.3)  # it tumbles: the inertia is asymmetric
    momentum_N__end, energy_end = momentum_and_energy()
    assert momentum_N__end == pytest.approx(momentum_N, rel=1e-6)
    assert energy_end == pytest.approx(energy, rel=1e-8)
    assert np.linalg.norm(truth.q_NB) == pytest.approx(1.0, abs=1e-15)
    assert plant.specific_force() == pytest.approx([0.0, 0.0, 0.0], abs=1e-12)


def test_symmetric_body_precesses_at_the_known_rate() -> None:
    plant = make_plant(Body(**{**BODY.__dict__, "inertia": (0.007, 0.007, 0.012)}))
    plant.advance(NO_SPEED, 1.5)
    # In the body frame the rate turns about z with (I_z - I_x) / I_x * w_z.
    turn = (0.012 - 0.007) / 0.007 * 4.0 * 1.5
    expected = Rotation.from_euler("z", turn).apply([3.0, -2.0, 4.0])
    assert plant.odometry(0).w_NB_B == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize("rotor_time_constant", [0.0, 0.04])
def test_converges_with_order_4(rotor_time_constant: float) -> None:
    body = Body(**{**BODY.__dict__, "drag_coefficient": (0.3, 0.2, 0.1)})

    def end(step: float) -> Any:
        plant = make_plant(body, step=step, rotor_time_constant=rotor_time_constant)
        plant.advance(UNEVEN, 0.32, wind_N=(0.4, -0.3, 0.2))
        return state(plant)

    reference = end(0.32 / 1024)
    errors = [float(np.linalg.norm(end(0.32 / n) - reference)) for n in (8, 16, 32)]
    orders = [math.log2(coarse / fine) for coarse, fine in itertools.pairwise(errors)]
    assert orders == pytest.approx([4.0, 4.0], abs=0.25)
    assert float(np.linalg.norm(end(0.005) - reference)) < 1e-7  # the step that the scenarios use


def test_hovers_when_thrust_carries_the_weight() -> None:
    speed = math.sqrt(BODY.mass * GRAVITY / 4.0 / BODY.thrust_coefficient)
    plant = make_plant(q_NB=(0.0, 0.0, math.sin(0.6), math.cos(0.6)), v_NB_N=(0.0,) * 3, w_NB_B=(0.0,) * 3)
    plant.advance((speed,) * 4, 1.0)
    assert plant.odometry(0).p_NB_N == pytest.approx([1.0, -2.0, 3.0], abs=1e-12)
    assert plant.specific_force() == pytest.approx([0.0, 0.0, GRAVITY])


def test_specific_force_is_thrust_drag_and_wind_per_mass_in_the_body_frame() -> None:
    body = Body(**{**BODY.__dict__, "drag_coefficient": (0.3, 0.2, 0.1)})
    plant = make_plant(body)
    assert plant.specific_force()[2] * body.mass == pytest.approx(
        4.0 * body.thrust_coefficient * 450.0**2 - 0.1 * plant.odometry(0).v_NB_B[2]
    )
    plant.advance(UNEVEN, 0.05, wind_N=(0.5, -1.0, 0.25), thrust_scale=0.9)
    truth = plant.odometry(0)
    thrust = 0.9 * body.thrust_coefficient * sum(speed**2 for speed in UNEVEN)
    wind_B = Rotation.from_quat(truth.q_NB).inv().apply([0.5, -1.0, 0.25])
    force_B = np.array([0.0, 0.0, thrust]) - np.array([0.3, 0.2, 0.1]) * truth.v_NB_B + wind_B
    assert plant.specific_force() == pytest.approx(force_B / body.mass)


def test_rotors_follow_with_the_lag_from_their_present_speed() -> None:
    plant = make_plant(rotor_time_constant=0.03, rotor_speed=400.0, w_NB_B=(0.0, 0.0, 0.0))
    plant.advance((500.0,) * 4, 0.05)
    plant.advance((420.0,) * 4, 0.05)
    after_first = 500.0 - 100.0 * math.exp(-0.05 / 0.03)
    after_second = 420.0 + (after_first - 420.0) * math.exp(-0.05 / 0.03)
    thrust = 4.0 * BODY.thrust_coefficient * after_second**2
    assert plant.specific_force() == pytest.approx([0.0, 0.0, thrust / BODY.mass])


def test_terminal_velocity_under_drag() -> None:
    body = Body(**{**BODY.__dict__, "drag_coefficient": (2.0, 2.0, 2.0)})
    plant = make_plant(body)
    plant.advance(NO_SPEED, 5.0, wind_N=(1.0, 0.0, 0.0))
    truth = plant.odometry(0)
    v_NB_N = Rotation.from_quat(truth.q_NB).apply(truth.v_NB_B)
    assert v_NB_N == pytest.approx([0.5, 0.0, -BODY.mass * GRAVITY / 2.0], abs=1e-4)
