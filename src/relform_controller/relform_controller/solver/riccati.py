"""The Riccati recursion: minimise the quadratic program of the team with some commands held fixed.

With the cost-to-go 1/2 dz' P_{k+1} dz + p_{k+1}' dz, stage k costs in (dz, du)

    G = [Q S'; S R] + [A B]' P_{k+1} [A B],   g = [q; r] + [A B]' p_{k+1}.

The free commands minimise it: with L L' = G_ff and Y = L^-1 G_fz, y = L^-1 (g_f + G_fc w),

    du_f = -L'^-1 (Y dz + y),   P_k = G_zz - Y' Y,   p_k = g_z + G_zc w - Y' y,

where w are the values of the fixed commands c. The deviations start at zero and have no gaps
(`team_qp.about`). The matrices do not depend on gradients, nor on w: `factorize` is the part before the
measurement.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import LinAlgError, cholesky, solve_triangular

from relform_controller.solver.solver import QpError
from relform_controller.solver.team_qp import TeamQp
from relform_core.arrays import Array


@dataclass(frozen=True, eq=False)
class Factors:
    """The matrices of every stage."""

    P: list[Array]
    """Of stages 0..N, shape (nz, nz)."""
    G_uz: list[Array]
    """Shape (nu, nz)."""
    G_uu: list[Array]
    """Shape (nu, nu)."""
    L: list[Array]
    """Of the free commands."""
    Y: list[Array]
    """Shape (free command, nz)."""
    free: Array
    """Which commands are free, shape (stage, nu)."""


@dataclass(frozen=True, eq=False)
class Trajectory:
    """The minimiser."""

    dz: Array
    """Shape (stage 0..N, nz)."""
    du: Array
    """Shape (stage 0..N-1, nu)."""
    slope: Array
    """Derivative of the least cost by each command: zero where it is free, shape (stage, nu)."""


def factorize(qp: TeamQp, free: Array) -> Factors:
    """The backward sweep of the matrices.

    Args:
        qp: the quadratic program.
        free: which commands are free, shape (stage, nu).
    Raises:
        QpError: the Hessian is not finite or not positive definite.
    """
    n_stages = len(qp.A)
    P: list[Array] = [qp.Q[n_stages]]
    G_uz, G_uu, L, Y = [], [], [], []
    for k in reversed(range(n_stages)):
        f, A, B = free[k], qp.A[k], qp.B[k]
        G_uz.append(qp.S[k] + B.T @ P[-1] @ A)
        G_uu.append(qp.R[k] + B.T @ P[-1] @ B)
        try:
            L.append(cholesky(G_uu[-1][np.ix_(f, f)], lower=True))
        except (LinAlgError, ValueError):
            raise QpError("the Hessian is not finite or not positive definite") from None
        Y.append(solve_triangular(L[-1], G_uz[-1][f], lower=True))
        P.append(qp.Q[k] + A.T @ P[-1] @ A - Y[-1].T @ Y[-1])
    return Factors(P[::-1], G_uz[::-1], G_uu[::-1], L[::-1], Y[::-1], free)


def minimize(qp: TeamQp, factors: Factors, fixed: Array) -> Trajectory:
    """The sweeps of the vectors, backward and forward.

    Args:
        qp: the quadratic program, without gaps.
        factors: of its matrices.
        fixed: values of the fixed commands; others do not matter, shape (stage, nu).
    Raises:
        QpError: the numbers are too large to compute with.
    """
    n_stages = len(qp.A)
    w = np.where(factors.free, 0.0, fixed)
    p, y, g_u = qp.q[n_stages], [np.empty(0)] * n_stages, [np.empty(0)] * n_stages
    for k in reversed(range(n_stages)):
        f = factors.free[k]
        g_u[k] = qp.r[k] + qp.B[k].T @ p + factors.G_uu[k] @ w[k]
        y[k] = _solved(factors.L[k], g_u[k][f], lower=True)
        p = qp.q[k] + qp.A[k].T @ p + factors.G_uz[k].T @ w[k] - factors.Y[k].T @ y[k]
    dz, du, slope = [np.zeros_like(p)], w.copy(), np.zeros_like(w)
    for k in range(n_stages):
        f = factors.free[k]
        du[k, f] = -_solved(factors.L[k].T, factors.Y[k] @ dz[k] + y[k], lower=False)
        # g_u has G_uc w already: what is left are the free commands.
        change = factors.G_uz[k] @ dz[k] + factors.G_uu[k] @ np.where(f, du[k], 0.0) + g_u[k]
        slope[k] = np.where(f, 0.0, change)
        dz.append(qp.A[k] @ dz[k] + qp.B[k] @ du[k])
    return Trajectory(np.array(dz), du, slope)


def _solved(triangle: Array, right: Array, lower: bool) -> Array:
    try:
        solution: Array = solve_triangular(triangle, right, lower=lower)
    except ValueError:  # infinite or no numbers
        raise QpError("the gradient is not finite") from None
    return solution
