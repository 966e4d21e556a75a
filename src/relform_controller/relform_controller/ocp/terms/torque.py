"""The torque of each vehicle (eq. CostFunc1), scaled by its inertia: I_0 / I tau_B (``scaling``) [N m]."""

import casadi as ca

from relform_controller.ocp.model import torque_B
from relform_controller.ocp.problem import Ocp
from relform_controller.ocp.scaling import torque_scale
from relform_controller.ocp.terms.term import VehicleStage, VehicleTerm


def _residual(ocp: Ocp, stage: VehicleStage) -> ca.SX:
    return ca.DM(torque_scale(ocp.body)) * torque_B(stage.commands, ocp.body)


TORQUE = VehicleTerm("torque", _residual, weight=lambda _, weights: weights.torque)
