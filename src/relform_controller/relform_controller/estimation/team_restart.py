"""A belief that has proved wrong: place one vehicle again, or the whole team in the world."""

from dataclasses import replace

import numpy as np

from relform_controller.estimation import team_model, team_noise
from relform_controller.estimation.relative_yaw import relative_position_B, yaw_from_mutual_sight
from relform_controller.estimation.team_belief import Belief
from relform_controller.ocp import layout
from relform_controller.ocp.frames import rotation_CB, rotation_z, wrap_angle
from relform_core.arrays import Array
from relform_core.sensors.range_bearing import RangeBearing

TURN_Z = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
"""Derivative of R_z(yaw) by the yaw at zero."""


def placed_again(
    belief: Belief, i: int, j: int, seen_by_i: RangeBearing, seen_by_j: RangeBearing
) -> Belief | None:
    """The belief with position and yaw of vehicle j from what i and j see of each other (eq. YawEst5).

    Everything else about j stays, but may be wrong too. None: the relative yaw cannot be observed.
    """
    tilts = belief.states[:, [layout.ROLL, layout.PITCH]]
    R_CB = {k: rotation_CB(float(tilts[k, 0]), float(tilts[k, 1])) for k in (i, j)}
    yaw = yaw_from_mutual_sight(seen_by_i, R_CB[i], seen_by_j, R_CB[j])
    if not yaw.variance < team_noise.RESTART[layout.YAW] ** 2:
        return None
    yaw_NC = float(belief.states[i, layout.YAW])
    offset_N = rotation_z(yaw_NC) @ R_CB[i] @ relative_position_B(seen_by_i)
    states, rows = belief.states.copy(), belief.factor.reshape(len(belief.states), -1, belief.factor.shape[1])
    turn = wrap_angle(yaw_NC + yaw.yaw - float(states[j, layout.YAW]))
    states[j, layout.VELOCITY] = rotation_z(turn) @ states[j, layout.VELOCITY]
    states[j, team_model.DISTURBANCE] = 0.0
    states[j, layout.POSITION] = states[i, layout.POSITION] + offset_N
    states[j, layout.YAW] = wrap_angle(yaw_NC + yaw.yaw)
    rows = rows.copy()
    # Errors of i are errors of j too, as j is placed relative to i.
    rows[j, layout.POSITION] = rows[i, layout.POSITION] + np.outer(TURN_Z @ offset_N, rows[i, layout.YAW])
    rows[j, layout.YAW] = rows[i, layout.YAW]
    own = np.zeros((len(states), team_model.N_FILTER_STATE))
    own[j] = team_noise.RESTART
    return replace(belief, states=states, factor=rows.reshape(belief.factor.shape)).widened(
        np.diag(own.reshape(-1))
    )


def unanchored(belief: Belief) -> Belief:
    """The belief with the place and the heading of the whole team in the world unknown, as a rigid body."""
    n = len(belief.states)
    common = np.zeros((n, team_model.N_FILTER_STATE, 4))
    common[:, layout.POSITION, :3] = team_noise.UNANCHORED_POSITION * np.eye(3)
    leader = belief.states[0, layout.POSITION]
    for vehicle, state in enumerate(belief.states):
        turned: Array = np.zeros(team_model.N_FILTER_STATE)
        turned[layout.POSITION] = TURN_Z @ (state[layout.POSITION] - leader)
        turned[layout.VELOCITY] = TURN_Z @ state[layout.VELOCITY]
        turned[team_model.DISTURBANCE] = TURN_Z @ state[team_model.DISTURBANCE]
        turned[layout.YAW] = 1.0
        common[vehicle, :, 3] = team_noise.UNANCHORED_YAW * turned
    return belief.widened(common.reshape(-1, 4))
