"""Compiled kernels of the solver: model and cost terms with derivatives, for all vehicles and stages."""

from collections.abc import Mapping, Sequence

import casadi as ca

from relform_controller.compiled import compiled
from relform_controller.ocp import layout
from relform_controller.ocp.model import UNDISTURBED, net_acceleration_I, rk4_step, states_of_acceleration
from relform_controller.ocp.problem import Ocp
from relform_controller.ocp.terms.term import CompiledFunction, Term


class Kernels:
    """The compiled functions of one optimal control problem.

    Raises:
        RelformError: there is no C compiler, or it fails.
    """

    def __init__(self, ocp: Ocp, terms: Sequence[Term]) -> None:
        """The terms are those of the problem's cost."""
        functions = [
            (_predict(ocp), ocp.n_vehicles),
            (_vehicle_stage(ocp), ocp.n_vehicles * ocp.n_stages),
            *(function for term in terms for function in term.functions),
        ]
        loaded = compiled(functions)
        self.predict = loaded["predict"]
        """(state, mean thrusts, disturbance if there is one) -> (state one control period later,), per
        vehicle."""
        self.vehicle_stage = loaded["vehicle_stage"]
        """(state, mean thrusts, disturbance if there is one) -> next state, A (12, 12), B (12, 4), net
        acceleration in {mi} (3,), its derivatives by the states that it depends on and by thrusts (3, 4); per
        vehicle and stage 0..N-1."""
        self.of_terms: Mapping[str, CompiledFunction] = loaded
        """The functions of the terms, by name, beside the two above."""


def _predict(ocp: Ocp) -> ca.Function:
    inputs, state, thrusts, acceleration_I = _vehicle(ocp)
    following = rk4_step(state, thrusts, ocp.body, ocp.period, acceleration_I)
    return ca.Function("predict", inputs, [following])


def _vehicle_stage(ocp: Ocp) -> ca.Function:
    inputs, state, thrusts, acceleration_I = _vehicle(ocp)
    by_thrusts = inputs[1]
    following = rk4_step(state, thrusts, ocp.body, ocp.stage, acceleration_I)
    acceleration = net_acceleration_I(state, thrusts, ocp.body) + acceleration_I
    outputs = [
        following,
        ca.jacobian(following, state),
        ca.jacobian(following, by_thrusts),
        acceleration,
        ca.jacobian(acceleration, state)[:, states_of_acceleration(ocp.body)],
        ca.jacobian(acceleration, by_thrusts),
    ]
    return ca.Function("vehicle_stage", inputs, [ca.densify(output) for output in outputs])


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
