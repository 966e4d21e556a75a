"""The change of each rotor's thrust from one stage to the next, scaled by G_0^-1 G (``scaling``) [N].

It is not in the paper.
"""

import casadi as ca

from relform_controller.ocp.problem import Ocp
from relform_controller.ocp.scaling import thrust_scale
from relform_controller.ocp.terms.term import VehicleStage, VehicleTerm


def _residual(ocp: Ocp, stage: VehicleStage) -> ca.SX:
    return ca.sparsify(ca.DM(thrust_scale(ocp.body))) @ (stage.commands - stage.commands_before)


THRUST_RATE = VehicleTerm("thrust_rate", _residual, weight=lambda _, weights: weights.thrust_rate)
