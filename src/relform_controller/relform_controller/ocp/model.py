"""Prediction model of one quadrotor in its own {mi}, in CasADi (eqs. MPC_Dynamics1 to 4)."""

from dataclasses import dataclass
from functools import cache

import casadi as ca
import numpy as np

from relform_controller.ocp import layout
from relform_core.arrays import Array
from relform_core.units import GRAVITY
from relform_core.vehicle_config import VehicleConfig

GRAVITY_I = ca.DM([0.0, 0.0, -GRAVITY])
"""g in {mi}: the rotation R_IN of eq. MPC_Dynamics2 is a yaw and leaves it unchanged [m/s^2]."""


UNDISTURBED = ca.DM.zeros(3)


@dataclass(frozen=True)
class RigidBody:
    """The nominal parameters that the prediction model uses."""

    mass: float
    inertia: tuple[float | ca.SX, float | ca.SX, float | ca.SX]
    """Of body x, y, z [kg m^2]; symbolic where an estimator finds them out."""
    arm_length: float
    torque_per_thrust: float
    """c_Q / c_T [m]."""
    drag: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Linear drag along body x, y, z [N s/m]."""

    @property
    def has_drag(self) -> bool:
        """Whether there is any. Without it the code of the functions has no trace of it."""
        return any(self.drag)

    @classmethod
    def from_config(cls, vehicle: VehicleConfig) -> "RigidBody":
        """The nominal body of a vehicle type."""
        return cls(
            vehicle.mass,
            vehicle.inertia,
            vehicle.arm_length,
            vehicle.torque_coefficient / vehicle.thrust_coefficient,
            vehicle.drag_coefficient,
        )


def rotation_IB(rpy_IB: ca.SX) -> ca.SX:
    """R_IB = R_z(yaw) R_y(pitch) R_x(roll), shape (3, 3)."""
    roll, pitch, yaw = ca.vertsplit(rpy_IB)
    R_x = ca.vertcat(
        ca.horzcat(1, 0, 0),
        ca.horzcat(0, ca.cos(roll), -ca.sin(roll)),
        ca.horzcat(0, ca.sin(roll), ca.cos(roll)),
    )
    R_y = ca.vertcat(
        ca.horzcat(ca.cos(pitch), 0, ca.sin(pitch)),
        ca.horzcat(0, 1, 0),
        ca.horzcat(-ca.sin(pitch), 0, ca.cos(pitch)),
    )
    return rotation_z(yaw) @ R_y @ R_x


def rotation_z(yaw: ca.SX) -> ca.SX:
    """R_z(yaw), shape (3, 3)."""
    return ca.vertcat(
        ca.horzcat(ca.cos(yaw), -ca.sin(yaw), 0),
        ca.horzcat(ca.sin(yaw), ca.cos(yaw), 0),
        ca.horzcat(0, 0, 1),
    )


def euler_rates_matrix(rpy_IB: ca.SX) -> ca.SX:
    """T of eq. MPC_Dynamics3: d/dt rpy_IB = T w_IB_B; singular at a pitch of +-90 deg."""
    roll, pitch, _ = ca.vertsplit(rpy_IB)
    return ca.vertcat(
        ca.horzcat(1, ca.sin(roll) * ca.tan(pitch), ca.cos(roll) * ca.tan(pitch)),
        ca.horzcat(0, ca.cos(roll), -ca.sin(roll)),
        ca.horzcat(0, ca.sin(roll) / ca.cos(pitch), ca.cos(roll) / ca.cos(pitch)),
    )


def force_B(thrusts: ca.SX, v_NB_B: ca.SX, body: RigidBody) -> ca.SX:
    """F_B of eq. Aerodynamics, from the thrust c_T w_k^2 of each rotor, and the linear drag [N]."""
    thrust_B = ca.vertcat(0, 0, ca.sum1(thrusts))
    return thrust_B - ca.diag(ca.DM(body.drag)) @ v_NB_B if body.has_drag else thrust_B


def torque_B(thrusts: ca.SX, body: RigidBody) -> ca.SX:
    """tau_B of eq. Aerodynamics [N m], from the thrust c_T w_k^2 of each rotor [N]."""
    front, left, back, right = ca.vertsplit(thrusts)
    return ca.vertcat(
        body.arm_length * (left - right),
        body.arm_length * (back - front),
        body.torque_per_thrust * (front - left + back - right),
    )


@cache
def torque_by_thrusts(body: RigidBody) -> Array:
    """Derivative of ``torque_B`` by the thrusts, a constant [m], shape (3, N_INPUT)."""
    thrusts = ca.SX.sym("thrusts", layout.N_INPUT)
    jacobian = ca.Function("torque", [], [ca.jacobian(torque_B(thrusts, body), thrusts)])
    constant = np.array(jacobian()["o0"])
    constant.flags.writeable = False  # every call returns the same array
    return constant


def net_acceleration_I(state: ca.SX, thrusts: ca.SX, body: RigidBody) -> ca.SX:
    """g + R_IB F_B / m, zero at hover [m/s^2] (right side of eq. MPC_Dynamics2 divided by m)."""
    R_IB = rotation_IB(state[layout.RPY])
    return GRAVITY_I + R_IB @ force_B(thrusts, R_IB.T @ state[layout.VELOCITY], body) / body.mass


def states_of_acceleration(body: RigidBody) -> slice:
    """The states that ``net_acceleration_I`` depends on."""
    return layout.VELOCITY_AND_RPY if body.has_drag else layout.RPY


def dynamics(
    state: ca.SX, thrusts: ca.SX, body: RigidBody, disturbance: ca.SX | ca.DM = UNDISTURBED
) -> ca.SX:
    """Time derivative of the state (layout.py), shape (12,).

    Args:
        disturbance: acceleration from unknown forces, in the velocity's frame [m/s^2], shape (3,).
    """
    v_IB_I, rpy_IB, w_IB_B = state[layout.VELOCITY], state[layout.RPY], state[layout.RATE]
    inertia = ca.diag(ca.vertcat(*body.inertia))
    return ca.vertcat(
        v_IB_I,  # eq. MPC_Dynamics1
        net_acceleration_I(state, thrusts, body) + disturbance,  # eq. MPC_Dynamics2
        euler_rates_matrix(rpy_IB) @ w_IB_B,  # eq. MPC_Dynamics3
        ca.inv(inertia) @ (torque_B(thrusts, body) - ca.cross(w_IB_B, inertia @ w_IB_B)),  # eq. MPC_Dynamics4
    )


def rk4_step(
    state: ca.SX,
    thrusts: ca.SX,
    body: RigidBody,
    period: float | ca.SX,
    disturbance: ca.SX | ca.DM = UNDISTURBED,
) -> ca.SX:
    """State one period later under constant thrusts: one step of the classical Runge-Kutta method."""
    k1 = dynamics(state, thrusts, body, disturbance)
    k2 = dynamics(state + period / 2 * k1, thrusts, body, disturbance)
    k3 = dynamics(state + period / 2 * k2, thrusts, body, disturbance)
    k4 = dynamics(state + period * k3, thrusts, body, disturbance)
    return state + period / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
