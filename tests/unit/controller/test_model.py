"""What each rotor does to the predicted vehicle; the oracle tests integrate the whole model."""

import dataclasses

import casadi as ca
import numpy as np
import numpy.typing as npt
import pytest

from relform_controller.ocp import layout
from relform_controller.ocp.model import RigidBody, dynamics, force_B, net_acceleration_I, torque_B
from support.scenarios import paper_scenario

VEHICLE = paper_scenario().config.vehicle
BODY = RigidBody.from_config(VEHICLE)
HOVER = np.full(4, VEHICLE.hover_thrust)
FRONT, LEFT, BACK, RIGHT = range(4)


def evaluate(
    *outputs: ca.SX, x: ca.SX, u: ca.SX, state: npt.ArrayLike, thrusts: npt.ArrayLike
) -> list[np.ndarray]:
    values = ca.Function("f", [x, u], outputs).call([ca.DM(state), ca.DM(thrusts)])
    return [np.array(value).reshape(-1) for value in values]


def rate(state: npt.ArrayLike, thrusts: npt.ArrayLike) -> np.ndarray:
    x, u = ca.SX.sym("x", layout.N_STATE), ca.SX.sym("u", layout.N_INPUT)
    return evaluate(dynamics(x, u, BODY), x=x, u=u, state=state, thrusts=thrusts)[0]


def torque(thrusts: npt.ArrayLike) -> np.ndarray:
    u = ca.SX.sym("u", layout.N_INPUT)
    return np.array(ca.Function("f", [u], [torque_B(u, BODY)])(ca.DM(thrusts))).reshape(-1)


def test_nominal_parameters_are_those_of_the_vehicle() -> None:
    assert BODY.mass == 0.716
    assert BODY.inertia == (0.007, 0.007, 0.012)
    assert BODY.arm_length == 0.18
    assert BODY.torque_per_thrust == pytest.approx(0.0160003, rel=1e-5)  # 1.3678e-7 / 8.54858e-6


@pytest.mark.parametrize("yaw", [-2.0, 0.0, 1.1])
def test_hover_is_an_equilibrium_at_any_yaw_and_velocity(yaw: float) -> None:
    state = np.zeros(layout.N_STATE)
    state[layout.VELOCITY], state[layout.YAW] = [1.5, -2.0, 0.3], yaw
    expected = np.zeros(layout.N_STATE)
    expected[layout.POSITION] = [1.5, -2.0, 0.3]
    np.testing.assert_allclose(rate(state, HOVER), expected, atol=1e-14)


@pytest.mark.parametrize(
    ("rotor", "signs"),
    [(FRONT, (0, -1, 1)), (LEFT, (1, 0, -1)), (BACK, (0, 1, 1)), (RIGHT, (-1, 0, -1))],
)
def test_more_thrust_of_one_rotor(rotor: int, signs: tuple[int, int, int]) -> None:
    """It lifts its own side, and its drag turns the vehicle against its own sense of rotation."""
    thrusts = HOVER.copy()
    thrusts[rotor] += 0.5
    roll, pitch, yaw = torque(thrusts)
    np.testing.assert_allclose([roll, pitch], 0.18 * 0.5 * np.array(signs[:2]), atol=1e-15)
    assert yaw == pytest.approx(0.016 * 0.5 * signs[2], rel=1e-4)


def test_thrust_is_upwards_in_the_body() -> None:
    u = ca.SX.sym("u", layout.N_INPUT)
    force = np.array(
        ca.Function("f", [u], [force_B(u, ca.SX([1.0, -2.0, 0.5]), BODY)])(ca.DM([1.0, 1.5, 2.0, 0.25]))
    ).reshape(-1)
    np.testing.assert_allclose(force, [0.0, 0.0, 4.75])


def test_drag_acts_against_the_velocity_in_the_body() -> None:
    """1, -2, 0.5 m/s with 0.3, 0.2, 0.1 N s/m."""
    u, body = ca.SX.sym("u", layout.N_INPUT), dataclasses.replace(BODY, drag=(0.3, 0.2, 0.1))
    force = ca.Function("f", [u], [force_B(u, ca.SX([1.0, -2.0, 0.5]), body)])
    np.testing.assert_allclose(np.array(force(ca.DM([4.0, 4.0, 4.0, 4.0]))).reshape(-1), [-0.3, 0.4, 15.95])


def test_net_acceleration_of_a_vehicle_that_pitches_nose_down_is_forward() -> None:
    """30 deg nose down at yaw 90 deg with 2 g: half of 2 g to the left, and (sqrt(3) - 1) g up."""
    x, u = ca.SX.sym("x", layout.N_STATE), ca.SX.sym("u", layout.N_INPUT)
    state = np.zeros(layout.N_STATE)
    state[layout.PITCH], state[layout.YAW] = np.radians([30.0, 90.0])
    (acceleration,) = evaluate(net_acceleration_I(x, u, BODY), x=x, u=u, state=state, thrusts=2.0 * HOVER)
    np.testing.assert_allclose(acceleration, [0.0, 9.81, (np.sqrt(3.0) - 1.0) * 9.81], atol=1e-12)


def test_a_spinning_body_that_is_not_round_wobbles() -> None:
    """Eq. MPC_Dynamics4 without torque: I w' = -w x I w, in numbers for w = (1, 2, 3) rad/s."""
    state = np.zeros(layout.N_STATE)
    state[layout.RATE] = [1.0, 2.0, 3.0]
    # I w = (.007, .014, .036), w x I w = (2 * .036 - 3 * .014, 3 * .007 - 1 * .036, 1 * .014 - 2 * .007)
    np.testing.assert_allclose(
        rate(state, HOVER)[layout.RATE], [-0.03 / 0.007, 0.015 / 0.007, 0.0], atol=1e-12
    )
