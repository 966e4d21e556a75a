"""Scales of the cost (eq. CostFunc1), so that one tuning flies other vehicles and larger teams.

The weights are those of three Hummingbirds, for which every scale is exactly one. For another vehicle,
torques and thrusts count by the accelerations that they cause: the thrusts u give the accelerations G u, the
force per mass and the torques per moment of inertia. With G_0 of the Hummingbird, u counts as the thrusts
G_0^-1 G u, which accelerate a Hummingbird alike.
"""

import numpy as np

from relform_controller.ocp.layout import ordered_pairs
from relform_controller.ocp.model import RigidBody
from relform_controller.ocp.problem import Ocp
from relform_core.arrays import Array

HUMMINGBIRD = RigidBody(
    mass=0.716,
    inertia=(0.007, 0.007, 0.012),
    arm_length=0.18,
    torque_per_thrust=1.3678e-7 / 8.54858e-6,
)
"""As in ``config/vehicles/hummingbird.yaml``."""
TEAM_SIZE = 3

_SIGNS = np.array(
    [[1.0, 1.0, 1.0, 1.0], [0.0, 1.0, 0.0, -1.0], [-1.0, 0.0, 1.0, 0.0], [1.0, -1.0, 1.0, -1.0]]
)
"""S of G = D S with a diagonal D: how each rotor acts on F_3 and on the torque about x, y and z."""
_SIGNS_INVERSE = _SIGNS.T / (_SIGNS**2).sum(axis=1)
"""The rows of S are orthogonal, and the quotients are exact in floating point."""


def torque_scale(body: RigidBody) -> Array:
    """I_0 / I about body x, y, z: torques that turn a Hummingbird alike per torque, shape (3,)."""
    scale: Array = np.array(HUMMINGBIRD.inertia) / np.array(body.inertia)
    return scale


def thrust_scale(body: RigidBody) -> Array:
    """G_0^-1 G: thrusts that accelerate a Hummingbird alike by the thrusts of this body, shape (4, 4)."""
    scale: Array = _SIGNS_INVERSE @ np.diag(_accelerations(body) / _accelerations(HUMMINGBIRD)) @ _SIGNS
    return scale


def formation_scale(ocp: Ocp) -> float:
    """Factor on the formation weights: the terms per vehicle of a team of three over those of this team.

    It is 2 / (n - 1) if all pairs are in the cost.
    """
    n = ocp.n_vehicles
    return n * _formation_terms(ocp, TEAM_SIZE) / (TEAM_SIZE * _formation_terms(ocp, n))


def leader_scale(ocp: Ocp) -> float:
    """Factor on the weights of the leader's position and yaw: the size of this team over three.

    All vehicles move with the leader, and the effort of each is in the cost.
    """
    return ocp.n_vehicles / TEAM_SIZE


def _accelerations(body: RigidBody) -> Array:
    """Diagonal of D: accelerations by the thrust of one rotor, shape (4,)."""
    x, y, z = body.inertia
    return np.array([1.0 / body.mass, body.arm_length / x, body.arm_length / y, body.torque_per_thrust / z])


def _formation_terms(ocp: Ocp, n_vehicles: int) -> int:
    return sum(ocp.in_formation_cost(i, j) for i, j in ordered_pairs(n_vehicles))
