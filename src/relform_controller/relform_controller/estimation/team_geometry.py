"""A belief of the team filter in the {mi} frames of the vehicles, as the controller uses it."""

import numpy as np

from relform_controller.estimation import team_model
from relform_controller.estimation.estimator import TeamCovariances
from relform_controller.estimation.team_filter import Belief
from relform_controller.ocp import layout
from relform_controller.ocp.frames import rotation_z, wrap_angle
from relform_controller.ocp.problem import Disturbances, TeamGeometry
from relform_core.arrays import Array

_POSE = [*range(team_model.N_FILTER_STATE)[layout.POSITION], layout.YAW]


def states_and_geometry(belief: Belief) -> tuple[Array, TeamGeometry]:
    """Start of the horizon: states in {mi}, shape (vehicle, N_STATE), and where the {mi} frames lie."""
    n = len(belief.states)
    p_NI_N, yaw_NI = belief.states[:, layout.POSITION], belief.states[:, layout.YAW]
    R_IN = [rotation_z(-float(yaw)) for yaw in yaw_NI]
    states = np.zeros((n, layout.N_STATE))
    states[:, layout.RPY] = belief.states[:, layout.RPY]
    states[:, layout.YAW] = 0.0
    states[:, layout.RATE] = belief.states[:, layout.RATE]
    acceleration_I = np.zeros((n, 3))
    for vehicle, filtered in enumerate(belief.states):
        states[vehicle, layout.VELOCITY] = R_IN[vehicle] @ filtered[layout.VELOCITY]
        acceleration_I[vehicle] = R_IN[vehicle] @ filtered[team_model.DISTURBANCE]
    pairs = layout.ordered_pairs(n)
    geometry = TeamGeometry(
        p_I1I2_I1=np.array([R_IN[i] @ (p_NI_N[j] - p_NI_N[i]) for i, j in pairs]),
        yaw_I1I2=np.array([wrap_angle(float(yaw_NI[j] - yaw_NI[i])) for i, j in pairs]),
        p_NI_N=p_NI_N[0].copy(),
        yaw_NI=float(yaw_NI[0]),
        disturbances=Disturbances(acceleration_I, belief.states[:, team_model.THRUST_SCALE].copy()),
    )
    return states, geometry


def covariances(belief: Belief, geometry: TeamGeometry) -> TeamCovariances:
    """How well the belief knows its geometry."""
    rows = belief.factor.reshape(len(belief.states), team_model.N_FILTER_STATE, -1)[:, _POSE]
    factors = []
    for pair, (i, j) in enumerate(layout.ordered_pairs(len(belief.states))):
        R_IN = rotation_z(-float(belief.states[i, layout.YAW]))
        difference = rows[j] - rows[i]
        x, y, _ = geometry.p_I1I2_I1[pair]
        by_yaw = np.array([[y], [-x], [0.0]])  # a turn of the observer turns what it sees the other way
        position = R_IN @ difference[:3] + by_yaw * rows[i, 3]
        factors.append(np.vstack([position, difference[3]]))
    stacked = np.array(factors)
    return TeamCovariances(stacked @ stacked.swapaxes(1, 2), rows[0] @ rows[0].T)
