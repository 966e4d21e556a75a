"""The leader on its path: position in the world (eqs. CostFunc1 and CostFunc2) [m]."""

import casadi as ca

from relform_controller.ocp import layout
from relform_controller.ocp.model import rotation_z
from relform_controller.ocp.scaling import leader_scale
from relform_controller.ocp.terms.term import LeaderStage, LeaderTerm


def _residual(stage: LeaderStage) -> ca.SX:
    R_NI = rotation_z(stage.yaw_NI)
    p_NB_N = stage.p_NI_N + R_NI @ stage.state[layout.POSITION]  # eq. Leader_States1
    return p_NB_N - stage.p_NB_N__ref


LEADER_POSITION = LeaderTerm(
    "leader_position", _residual, weight=lambda ocp, weights: leader_scale(ocp) * weights.leader_position
)
