"""The model of the team filter, in CasADi: how one vehicle moves, and what its sensors should measure.

A vehicle's state is that of eq. MPC_StateDef, but in the world frame {n}, followed by what the nominal model
does not know: an acceleration from unknown forces, a factor on the thrust and torque of all rotors, and one
on each moment of inertia.
"""

from dataclasses import replace

import casadi as ca

from relform_controller.ocp import layout
from relform_controller.ocp.model import RigidBody, force_B, rk4_step, rotation_IB

DISTURBANCE = slice(12, 15)
"""Acceleration from unknown forces in {n} [m/s^2]."""
THRUST_SCALE = 15
"""True thrust over nominal thrust."""
INERTIA_SCALE = slice(16, 19)
"""True over nominal moments of inertia about body x, y, z."""
N_FILTER_STATE = 19

# Rows of what one vehicle measures of itself.
TILT_ROWS = slice(0, 2)
"""Roll and pitch [rad]."""
RATE_ROWS = slice(2, 5)
"""Angular velocity [rad/s]."""
SPECIFIC_FORCE_ROWS = slice(5, 8)
"""What an accelerometer measures [m/s^2]."""
FLOW_ROWS = slice(8, 11)
"""Velocity in the body frame, measured by optic flow [m/s]."""
HEIGHT_ROW = 11
"""Height above the ground [m]."""
POSITION_ROWS = slice(12, 15)
"""Position in {n} [m]."""
VELOCITY_ROWS = slice(15, 18)
"""Velocity in the body frame, measured by the localization [m/s]."""
YAW_ROW = 18
"""Yaw in {n} [rad]."""
FORCE_ROWS = slice(19, 23)
"""Disturbance and thrust scale: no sensor measures them, but they are known to be moderate."""
N_OWN_ROWS = 23
LOCALIZATION_ROWS = slice(12, 19)
"""All that the localization measures."""
ANGULAR_ROWS = [*range(N_OWN_ROWS)[TILT_ROWS], YAW_ROW]
"""Angles, whose differences must be wrapped."""
N_SIGHT_ROWS = 3
"""Range [m], azimuth and elevation [rad] of one sighting (eqs. CameraRange1, 2)."""


def transition(body: RigidBody) -> ca.Function:
    """(state, thrusts, duration) -> state after the duration, its Jacobian by the state (19, 19).

    One step of the classical Runge-Kutta method under constant thrusts; disturbance and thrust scale stay.
    """
    state, thrusts, duration = _state("state"), _thrusts(), ca.SX.sym("duration")

    (I_x, I_y, I_z), scale = body.inertia, state[INERTIA_SCALE]
    true_body = replace(body, inertia=(I_x * scale[0], I_y * scale[1], I_z * scale[2]))
    moved = rk4_step(
        state[: layout.N_STATE], state[THRUST_SCALE] * thrusts, true_body, duration, state[DISTURBANCE]
    )
    following = ca.vertcat(moved, state[layout.N_STATE :])
    return _with_jacobians("transition", [state, thrusts, duration], following, [state])


def own_measurement(body: RigidBody) -> ca.Function:
    """(state, thrusts) -> what a vehicle measures of itself (23,), its Jacobian by the state (23, 19).

    The specific force is that at the end of an interval in which the rotors gave these thrusts.
    """
    state, thrusts = _state("state"), _thrusts()
    R_BN = rotation_IB(state[layout.RPY]).T
    v_NB_B = R_BN @ state[layout.VELOCITY]
    known_acceleration_B = force_B(state[THRUST_SCALE] * thrusts, v_NB_B, body) / body.mass
    measured = ca.vertcat(
        state[layout.ROLL],
        state[layout.PITCH],
        state[layout.RATE],
        known_acceleration_B + R_BN @ state[DISTURBANCE],
        v_NB_B,
        state[layout.POSITION][2],
        state[layout.POSITION],
        v_NB_B,
        state[layout.YAW],
        state[DISTURBANCE],
        state[THRUST_SCALE],
    )
    return _with_jacobians("own_measurement", [state, thrusts], measured, [state])


def sighting() -> ca.Function:
    """(observer, target) -> range, azimuth, elevation (3,), its Jacobians by both states (3, 19)."""
    observer, target = _state("observer"), _state("target")
    R_BN = rotation_IB(observer[layout.RPY]).T
    p_B1B2_B1 = R_BN @ (target[layout.POSITION] - observer[layout.POSITION])
    x, y, z = ca.vertsplit(p_B1B2_B1)
    horizontal = ca.sqrt(x**2 + y**2)
    seen = ca.vertcat(ca.sqrt(x**2 + y**2 + z**2), ca.atan2(y, x), ca.atan2(z, horizontal))
    return _with_jacobians("sighting", [observer, target], seen, [observer, target])


def _state(name: str) -> ca.SX:
    return ca.SX.sym(name, N_FILTER_STATE)


def _thrusts() -> ca.SX:
    return ca.SX.sym("thrusts", layout.N_INPUT)


def _with_jacobians(name: str, inputs: list[ca.SX], output: ca.SX, by: list[ca.SX]) -> ca.Function:
    outputs = [output, *(ca.jacobian(output, each) for each in by)]
    return ca.Function(name, inputs, [ca.densify(each) for each in outputs])
