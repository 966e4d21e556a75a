"""The QP of an SQP step, condensed from the model and the terms of the cost, and solved by DAQP."""

from dataclasses import dataclass

import casadi as ca
import daqp
import numpy as np

from relform_analysis.bench.streams import Instance
from relform_analysis.bench.team_problem import TeamProblem
from relform_controller.ocp.problem import Ocp
from relform_controller.ocp.terms.registry import TERMS
from relform_controller.solver.team_qp import TeamQp
from relform_core.arrays import Array


@dataclass(frozen=True, eq=False)
class CondensedQp:
    """min 1/2 x' H x + g' x + prices of v >= 0 within bounds, C x + c <= v, over the change of all inputs."""

    H: Array
    g: Array
    lower: Array
    upper: Array
    C: Array
    c: Array
    price: Array
    square_price: Array


class Condenser:
    """Condenses instances of a problem."""

    def __init__(self, ocp: Ocp) -> None:
        self.ocp, self.team = ocp, TeamProblem(ocp, TERMS)
        team = self.team
        arguments, by = [team.z, team.u, team.p], ca.vertcat(team.z, team.u)
        self.stages = [
            ca.Function("stage", arguments, [residual, ca.jacobian(residual, by)])
            for residual in (team.first_residual, team.residual, team.last_residual)
        ]
        following = [team.following, ca.jacobian(team.following, team.z), ca.jacobian(team.following, team.u)]
        self.following = ca.Function("following", arguments, following)
        excess = [team.excess, ca.jacobian(team.excess, team.z)]
        self.excess = ca.Function("excess", [team.z, team.p], excess)

    def qp(self, instance: Instance) -> CondensedQp:
        states, inputs = self.team.guess(instance)
        parameters = self.team.parameters(instance)
        N, nu, nz = self.ocp.n_stages, inputs[0].size, states[0].size
        # Change of the state of a stage: offset + slope @ x.
        offset, slope = self.team.start(instance) - states[0], np.zeros((nz, N * nu))
        H, g = np.zeros((N * nu, N * nu)), np.zeros(N * nu)
        C, c = [np.zeros((0, N * nu))], [np.zeros(0)]
        for k in range(N + 1):
            function = self.stages[0 if k == 0 else 2 if k == N else 1]
            u = inputs[k] if k < N else np.zeros(nu)
            residual, jacobian = (np.array(out) for out in function(states[k], u, parameters[k]))
            J = jacobian[:, :nz] @ slope
            if k < N:
                J[:, k * nu : (k + 1) * nu] += jacobian[:, nz:]
            H += 2.0 * J.T @ J
            g += 2.0 * J.T @ (residual[:, 0] + jacobian[:, :nz] @ offset)
            if k > 0 and self.ocp.constraints.exist:
                excess, by_z = (np.array(out) for out in self.excess(states[k], parameters[k]))
                C.append(by_z @ slope)
                c.append(excess[:, 0] + by_z @ offset)
            if k < N:
                following, A, B = (np.array(out) for out in self.following(states[k], u, parameters[k]))
                offset = A @ offset + following[:, 0] - states[k + 1]
                slope = A @ slope
                slope[:, k * nu : (k + 1) * nu] += B
        thrusts = np.concatenate(inputs)
        return CondensedQp(
            H,
            g,
            self.ocp.thrust_min - thrusts,
            self.ocp.thrust_max - thrusts,
            np.concatenate(C),
            np.concatenate(c),
            *np.tile(self.team.prices.T, N),
        )

    def first_inputs(self, instance: Instance) -> Array:
        """By DAQP [N], shape (vehicle, N_INPUT)."""
        x = solved(self.qp(instance))
        first = instance.guess.thrusts[:, 0]
        return first + x[: first.size].reshape(first.shape)


def solved(qp: CondensedQp) -> Array:
    """The minimiser, by DAQP at its highest accuracy."""
    n, n_soft = qp.g.size, qp.c.size
    assert (qp.square_price > 0.0).all(), "DAQP needs a positive definite Hessian"
    H, g = np.diag(np.concatenate([np.zeros(n), qp.square_price])), np.concatenate([qp.g, qp.price])
    H[:n, :n] = qp.H
    # Scaled to a unit diagonal and rows of length one, so that the tolerances mean the same for all.
    scale = 1.0 / np.sqrt(np.diag(H))
    rows = np.hstack([qp.C, -np.eye(n_soft)]) * scale
    length = np.linalg.norm(rows, axis=1)
    never = np.full(n_soft, 1e30)
    x, _, flag, _ = daqp.solve(
        scale[:, None] * H * scale,
        scale * g,
        rows / length[:, None],
        np.concatenate([qp.upper / scale[:n], never, -qp.c / length]),
        np.concatenate([qp.lower / scale[:n], np.zeros(n_soft), -never]),
        primal_tol=1e-12,
        dual_tol=1e-12,
        iter_limit=10_000,
    )
    assert flag == 1
    solution: Array = scale * x
    return solution[:n]


def condensed(qp: TeamQp, dz0: Array) -> CondensedQp:
    """A quadratic program of stages without soft constraints, condensed for one deviation of the start."""
    N, n_z, n_u = qp.B.shape
    H, g = np.zeros((N * n_u, N * n_u)), np.zeros(N * n_u)
    # Change of the state of a stage: offset + slope @ x.
    offset, slope = dz0, np.zeros((n_z, N * n_u))
    for k in range(N + 1):
        H += slope.T @ qp.Q[k] @ slope
        g += slope.T @ (qp.Q[k] @ offset + qp.q[k])
        if k < N:
            of_u, by_u = slice(k * n_u, (k + 1) * n_u), qp.S[k] @ slope
            H[of_u] += by_u
            H[:, of_u] += by_u.T
            H[of_u, of_u] += qp.R[k]
            g[of_u] += qp.r[k] + qp.S[k] @ offset
            offset, slope = qp.A[k] @ offset + qp.gap[k], qp.A[k] @ slope
            slope[:, of_u] += qp.B[k]
    no_rows = np.zeros((0, g.size)), np.zeros(0), np.zeros(0), np.zeros(0)
    return CondensedQp(H, g, qp.lower.reshape(-1), qp.upper.reshape(-1), *no_rows)


def improvable(qp: CondensedQp, x: Array) -> float:
    """How far the best value of any single input is from its value in x, if all others keep theirs.

    It is zero where the KKT conditions hold, and only there; qp has no soft constraints.
    """
    best = np.clip(x - (qp.H @ x + qp.g) / np.diag(qp.H), qp.lower, qp.upper)
    return float(np.abs(best - x).max())
