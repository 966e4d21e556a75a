"""One stage of the horizon in symbols: dynamics and cost of a vehicle, of the leader, and of a pair.

Both solvers evaluate these functions, for every vehicle, pair and stage. The stage state `z` of a vehicle is
its state, followed by the commands of the stage before (for the thrust rate) and, if the rotors may lag, by
the thrusts of its rotors. The Hessians are those of Gauss and Newton, 2 J' W J, upper triangles.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca

from relform_controller.ocp import layout
from relform_controller.ocp.constraints import Constraints
from relform_controller.ocp.model import net_acceleration_I, rk4_step, rotation_z
from relform_controller.ocp.problem import Ocp
from relform_controller.ocp.terms.term import LeaderStage, PairStage, Terms, VehicleStage

STATE = slice(0, layout.N_STATE)
BEFORE = slice(layout.N_STATE, layout.N_STATE + layout.N_INPUT)
ROTORS = slice(BEFORE.stop, BEFORE.stop + layout.N_INPUT)
"""Parts of the stage state of one vehicle; the last one only if the rotors may lag."""


def stage_state_size(ocp: Ocp) -> int:
    """Length of the stage state of one vehicle."""
    return ROTORS.stop if ocp.rotors_may_lag else BEFORE.stop


@dataclass(frozen=True, eq=False)
class StageFunctions:
    """CasADi functions of one stage. Their arguments are listed by the functions below."""

    vehicle: ca.Function
    leader_hessian: ca.Function
    leader_gradient: ca.Function
    pair_hessian: ca.Function
    pair_gradient: ca.Function
    vehicle_rows: ca.Function | None
    """None: there are no such constraints."""
    pair_rows: ca.Function | None


def stage_functions(ocp: Ocp, terms: Terms) -> StageFunctions:
    """The functions of a problem."""
    rows = _vehicle_rows(ocp.constraints), _pair_rows(ocp.constraints)
    return StageFunctions(_vehicle(ocp, terms), *_leader(terms), *_pair(terms), *rows)


def _vehicle(ocp: Ocp, terms: Terms) -> ca.Function:
    """(state, commands before, rotor thrusts, commands, disturbance, rotor memory, weight of each term) ->
    next state, its derivatives by state and by mean thrusts, cost, its gradient and Hessian by (z, commands).

    The disturbance is the acceleration from unknown forces, then true over nominal thrust, shape (4,). The
    memory m of the rotors gives the mean thrusts (``rotor_lag``).
    """
    state, before, rotors, commands, disturbance, memory = (
        ca.SX.sym(name, size)
        for name, size in (
            ("state", layout.N_STATE),
            ("before", layout.N_INPUT),
            ("rotors", layout.N_INPUT),
            ("commands", layout.N_INPUT),
            ("disturbance", 4),
            ("memory", 1),
        )
    )
    weights = ca.SX.sym("weights", len(terms.vehicle))
    mean_thrusts = ca.SX.sym("mean_thrusts", layout.N_INPUT)
    thrusts = disturbance[3] * mean_thrusts
    following = rk4_step(state, thrusts, ocp.body, ocp.stage, disturbance[:3])
    by_state, by_mean_thrusts = ca.jacobian(following, state), ca.jacobian(following, mean_thrusts)
    acceleration = net_acceleration_I(state, thrusts, ocp.body) + disturbance[:3]
    lagging = (1 - memory) * commands + memory * rotors if ocp.rotors_may_lag else commands
    following, by_state, by_mean_thrusts, acceleration = ca.substitute(
        [following, by_state, by_mean_thrusts, acceleration], [mean_thrusts], [lagging]
    )
    stage = VehicleStage(state, commands, before, acceleration)
    residuals = [term.residual(ocp, stage) for term in terms.vehicle]
    z = ca.vertcat(state, before, rotors) if ocp.rotors_may_lag else ca.vertcat(state, before)
    return ca.Function(
        "vehicle",
        [state, before, rotors, commands, disturbance, memory, weights],
        ca.cse([following, by_state, by_mean_thrusts, *_cost(residuals, weights, ca.vertcat(z, commands))]),
    )


def _leader(terms: Terms) -> tuple[ca.Function, ca.Function]:
    """(state, p_NI and yaw_NI, reference of p_NB and yaw_NB, weight of each term) -> Hessian of the cost by
    the state; and -> cost, gradient."""
    state, frame, reference = ca.SX.sym("state", layout.N_STATE), ca.SX.sym("frame", 4), ca.SX.sym("ref", 4)
    weights = ca.SX.sym("weights", len(terms.leader))
    stage = LeaderStage(state, frame[:3], frame[3], reference[:3], reference[3])
    residuals = [term.residual(stage) for term in terms.leader]
    return _hessian_and_gradient("leader", [state, frame, reference, weights], residuals, state)


def _pair(terms: Terms) -> tuple[ca.Function, ca.Function]:
    """(states of observer and target, p_I1I2 and yaw_I1I2, reference, weight of each term) -> Hessian of the
    cost by both states; and -> cost, gradient."""
    observer, target = ca.SX.sym("observer", layout.N_STATE), ca.SX.sym("target", layout.N_STATE)
    frame, reference = ca.SX.sym("frame", 4), ca.SX.sym("ref", 3)
    weights = ca.SX.sym("weights", len(terms.pair))
    stage = PairStage(observer, target, frame[:3], frame[3], reference)
    residuals = [term.residual(stage) for term in terms.pair]
    arguments = [observer, target, frame, reference, weights]
    return _hessian_and_gradient("pair", arguments, residuals, ca.vertcat(observer, target))


def _vehicle_rows(constraints: Constraints) -> ca.Function | None:
    """(state, p_NI and yaw_NI) -> every soft constraint h of a vehicle, and its derivatives by the state."""
    state, frame = ca.SX.sym("state", layout.N_STATE), ca.SX.sym("frame", 4)
    p_NB_N = frame[:3] + rotation_z(frame[3]) @ state[layout.POSITION]
    rows = [constraint.excess(state, p_NB_N) for constraint in constraints.vehicle]
    return _rows("vehicle_rows", [state, frame], rows, state)


def _pair_rows(constraints: Constraints) -> ca.Function | None:
    """(states of observer and target, p_I1I2 and yaw_I1I2) -> every soft constraint h of a pair, and its
    derivatives by both states."""
    observer, target = ca.SX.sym("observer", layout.N_STATE), ca.SX.sym("target", layout.N_STATE)
    frame = ca.SX.sym("frame", 4)
    p_I1B2_I1 = frame[:3] + rotation_z(frame[3]) @ target[layout.POSITION]
    p_B1B2_I1 = p_I1B2_I1 - observer[layout.POSITION]
    rows = [constraint.excess(observer, p_B1B2_I1) for constraint in constraints.pair]
    return _rows("pair_rows", [observer, target, frame], rows, ca.vertcat(observer, target))


def _rows(name: str, arguments: Sequence[ca.SX], rows: Sequence[ca.SX], by: ca.SX) -> ca.Function | None:
    if not rows:
        return None
    h = ca.vertcat(*rows)
    return ca.Function(name, arguments, ca.cse([h, ca.jacobian(h, by)]))


def _hessian_and_gradient(
    name: str, arguments: Sequence[ca.SX], residuals: Sequence[ca.SX], by: ca.SX
) -> tuple[ca.Function, ca.Function]:
    cost, gradient, hessian = _cost(residuals, arguments[-1], by)
    return (
        ca.Function(f"{name}_hessian", arguments, ca.cse([hessian])),
        ca.Function(f"{name}_gradient", arguments, ca.cse([cost, gradient])),
    )


def _cost(residuals: Sequence[ca.SX], weights: ca.SX, by: ca.SX) -> tuple[ca.SX, ca.SX, ca.SX]:
    """sum of weight * residual^2, its gradient, and its Gauss-Newton Hessian (upper triangle)."""
    cost, gradient = ca.SX(0), ca.SX(by.numel(), 1)
    hessian = ca.SX(by.numel(), by.numel())
    for index, residual in enumerate(residuals):
        jacobian, weight = ca.jacobian(residual, by), weights[index]
        cost += weight * ca.sumsqr(residual)
        gradient += 2 * weight * (jacobian.T @ residual)
        hessian += 2 * weight * (jacobian.T @ jacobian)
    return cost, gradient, ca.triu(hessian)
