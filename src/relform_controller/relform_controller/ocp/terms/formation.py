"""The formation: position of each target relative to its observer (eqs. CostFunc1 and CostFunc2) [m]."""

import casadi as ca

from relform_controller.ocp import layout
from relform_controller.ocp.model import rotation_z
from relform_controller.ocp.problem import Ocp
from relform_controller.ocp.scaling import formation_scale
from relform_controller.ocp.terms.term import PairStage, PairTerm
from relform_core.controller_config import WeightsConfig


def relative_position(
    p_I1B1_I1: ca.SX, yaw_I1B1: ca.SX, p_I2B2_I2: ca.SX, p_I1I2_I1: ca.SX, yaw_I1I2: ca.SX
) -> ca.SX:
    """p_B1B2_C1: position of vehicle 2 relative to vehicle 1 in {mc_1} (eqs. RelPos1 to RelPos4) [m]."""
    R_I1I2 = rotation_z(yaw_I1I2)
    p_I2B2_I1 = R_I1I2 @ p_I2B2_I2  # eq. RelPos1
    p_I1B2_I1 = p_I2B2_I1 + p_I1I2_I1  # eq. RelPos2
    p_B1B2_I1 = p_I1B2_I1 - p_I1B1_I1  # eq. RelPos3
    R_C1I1 = rotation_z(-yaw_I1B1)
    return R_C1I1 @ p_B1B2_I1  # eq. RelPos4


def _residual(stage: PairStage) -> ca.SX:
    p_B1B2_C1 = relative_position(
        stage.observer[layout.POSITION],
        stage.observer[layout.YAW],
        stage.target[layout.POSITION],
        stage.p_I1I2_I1,
        stage.yaw_I1I2,
    )
    return p_B1B2_C1 - stage.p_B1B2_C1__ref


def _weight(ocp: Ocp, weights: WeightsConfig, observer: int, target: int) -> float:
    return formation_scale(ocp) * weights.formation if ocp.in_formation_cost(observer, target) else 0.0


FORMATION = PairTerm("formation", _residual, _weight)
