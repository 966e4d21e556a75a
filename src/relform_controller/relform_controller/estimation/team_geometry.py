"""A belief of the team filter in the {mi} frames of the vehicles, as the controller uses it."""

from functools import cache

import numpy as np

from relform_controller.estimation import team_model
from relform_controller.estimation.estimator import TeamCovariances
from relform_controller.estimation.team_belief import Belief
from relform_controller.ocp import layout
from relform_controller.ocp.frames import wrap_angles
from relform_controller.ocp.problem import Disturbances, TeamGeometry
from relform_core.arrays import Array, Integers

_POSE = [*range(team_model.N_FILTER_STATE)[layout.POSITION], layout.YAW]


def states_and_geometry(belief: Belief) -> tuple[Array, TeamGeometry]:
    """Start of the horizon: states in {mi}, shape (vehicle, N_STATE), and where the {mi} frames lie."""
    observers, targets = _pairs(len(belief.states))
    p_NI_N, yaw_NI = belief.states[:, layout.POSITION], belief.states[:, layout.YAW]
    R_IN = _rotations_z(-yaw_NI)
    states = belief.states[:, : layout.N_STATE].copy()
    states[:, layout.POSITION] = 0.0
    states[:, layout.YAW] = 0.0
    states[:, layout.VELOCITY] = _rotated(R_IN, belief.states[:, layout.VELOCITY])
    geometry = TeamGeometry(
        p_I1I2_I1=_rotated(R_IN[observers], p_NI_N[targets] - p_NI_N[observers]),
        yaw_I1I2=wrap_angles(yaw_NI[targets] - yaw_NI[observers]),
        p_NI_N=p_NI_N[0].copy(),
        yaw_NI=float(yaw_NI[0]),
        disturbances=Disturbances(
            _rotated(R_IN, belief.states[:, team_model.DISTURBANCE]),
            belief.states[:, team_model.THRUST_SCALE].copy(),
        ),
    )
    return states, geometry


def covariances(belief: Belief, geometry: TeamGeometry) -> TeamCovariances:
    """How well the belief knows its geometry."""
    n = len(belief.states)
    observers, targets = _pairs(n)
    rows = belief.factor.reshape(n, team_model.N_FILTER_STATE, -1)[:, _POSE].reshape(4 * n, -1)
    poses = (rows @ rows.T).reshape(n, 4, n, 4)
    # Derivatives of p_I1I2_I1 and yaw_I1I2 by the poses of observer and target.
    by_target = np.zeros((len(observers), 4, 4))
    by_target[:, :3, :3] = _rotations_z(-belief.states[observers, layout.YAW])
    by_target[:, 3, 3] = 1.0
    by_observer = -by_target
    by_observer[:, 0, 3] = geometry.p_I1I2_I1[:, 1]  # a turn of the observer turns what it sees back
    by_observer[:, 1, 3] = -geometry.p_I1I2_I1[:, 0]
    J = np.concatenate([by_observer, by_target], axis=2)
    P = np.block(
        [
            [poses[observers, :, observers], poses[observers, :, targets]],
            [poses[targets, :, observers], poses[targets, :, targets]],
        ]
    )
    return TeamCovariances(J @ P @ J.swapaxes(1, 2), poses[0, :, 0])


@cache
def _pairs(n_vehicles: int) -> tuple[Integers, Integers]:
    """Observer and target of each pair."""
    observers, targets = np.array(layout.ordered_pairs(n_vehicles)).T
    return observers, targets


def _rotations_z(yaws: Array) -> Array:
    """R_z of each yaw, shape (n, 3, 3)."""
    rotations = np.zeros((len(yaws), 3, 3))
    rotations[:, 0, 0] = rotations[:, 1, 1] = np.cos(yaws)
    rotations[:, 1, 0] = np.sin(yaws)
    rotations[:, 0, 1] = -rotations[:, 1, 0]
    rotations[:, 2, 2] = 1.0
    return rotations


def _rotated(rotations: Array, vectors: Array) -> Array:
    """Each vector by its rotation, shape (n, 3)."""
    rotated: Array = (rotations @ vectors[:, :, None])[:, :, 0]
    return rotated
