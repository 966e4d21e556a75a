"""The compiled prediction of the vehicles over a control period."""

import casadi as ca

from relform_controller.compiled import Kernel, compiled
from relform_controller.ocp import layout
from relform_controller.ocp.model import UNDISTURBED, rk4_step
from relform_controller.ocp.problem import Ocp


def predictor(ocp: Ocp) -> Kernel:
    """(state, mean thrusts, disturbance if there is one) -> (state one control period later,), per vehicle.

    Raises:
        RelformError: the C compiler fails.
    """
    inputs, state, thrusts, acceleration_I = _vehicle(ocp)
    following = rk4_step(state, thrusts, ocp.body, ocp.period, acceleration_I)
    return compiled(ca.Function("predict", inputs, [following]), ocp.n_vehicles)


def _vehicle(ocp: Ocp) -> tuple[list[ca.SX], ca.SX, ca.SX, ca.SX | ca.DM]:
    """Inputs of a function of one vehicle; its state, true thrusts, and acceleration from unknown forces.

    Without disturbances the function has no input for them: its code stays that of the nominal model, and its
    results stay the same to the last digit.
    """
    state, thrusts = ca.SX.sym("state", layout.N_STATE), ca.SX.sym("thrusts", layout.N_INPUT)
    if not ocp.is_disturbed:
        return [state, thrusts], state, thrusts, UNDISTURBED
    disturbance = ca.SX.sym("disturbance", 4)
    return [state, thrusts, disturbance], state, disturbance[3] * thrusts, disturbance[:3]
