"""The leader along its heading: yaw in the world (eqs. CostFunc1 and CostFunc2) [rad]."""

import casadi as ca

from relform_controller.ocp import layout
from relform_controller.ocp.scaling import leader_scale
from relform_controller.ocp.terms.term import LeaderStage, LeaderTerm


def _residual(stage: LeaderStage) -> ca.SX:
    yaw_NB = stage.yaw_NI + stage.state[layout.YAW]  # eq. Leader_States3
    return yaw_NB - stage.yaw_NB__ref


LEADER_YAW = LeaderTerm(
    "leader_yaw", _residual, weight=lambda ocp, weights: leader_scale(ocp) * weights.leader_yaw
)
