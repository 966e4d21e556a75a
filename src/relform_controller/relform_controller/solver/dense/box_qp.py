"""Quadratic program with bounds: factorised once, then solved cheaply for any gradient."""

from dataclasses import dataclass

import daqp
import numpy as np
import numpy.typing as npt
from scipy.linalg import lapack

from relform_controller.solver.solver import QpError
from relform_core.arrays import Array

_ITERATIONS_MAX = 10
_TOLERANCE = 1e-9
"""How far beyond a bound a free variable may lie."""


@dataclass(frozen=True, eq=False)
class QpSolution:
    """Minimiser of a quadratic program with bounds."""

    x: Array
    multipliers: Array
    """Positive at an upper bound, negative at a lower one, zero where the variable is free."""
    iterations: int


class BoxQp:
    """minimize x' H x / 2 + g' x subject to lower <= x <= upper, for positive definite H.

    A primal-dual active-set method on the bounds (Hintermueller, Ito and Kunisch, 2003): it guesses which
    bounds are active, solves the equations that remain, and corrects the guess by the signs of the
    multipliers and the bounds that are violated. Few bounds are ever active here, so each guess costs one
    small dense system on top of the one factorisation. The method may cycle; daqp, a dual active-set solver,
    then takes over.

    Raises:
        QpError: H is not finite or not positive definite.
    """

    def __init__(self, hessian: Array, lower: Array, upper: Array) -> None:
        if not np.isfinite(hessian).all():
            raise QpError("the Hessian is not finite")
        self._factor, failed = lapack.dpotrf(hessian, lower=1)
        if failed:
            raise QpError("the Hessian is not positive definite")
        self._hessian, self._lower, self._upper = hessian, lower, upper

    def solve(self, gradient: Array) -> QpSolution:
        """The minimiser for one g.

        Raises:
            QpError: g is not finite, or neither method finds a solution.
        """
        if not np.isfinite(gradient).all():
            raise QpError("the gradient is not finite")
        unbounded = self._times_inverse(-gradient)
        x, multipliers = unbounded, np.zeros_like(unbounded)
        side = np.zeros(x.size, dtype=np.int64)  # -1, 1: at the lower, upper bound; 0: free
        for iteration in range(_ITERATIONS_MAX):
            kept = np.where(multipliers * side > 0.0, side, 0)
            violated = (x > self._upper + _TOLERANCE).astype(np.int64) - (x < self._lower - _TOLERANCE)
            guess = np.where(kept != 0, kept, violated)
            if np.array_equal(guess, side):
                return QpSolution(x, multipliers, iteration + 1)
            side = guess
            x, multipliers = self._on_bounds(unbounded, side)
        return self._by_dual_active_set(gradient)

    def _on_bounds(self, unbounded: Array, side: npt.NDArray[np.int64]) -> tuple[Array, Array]:
        """Minimiser and multipliers with some variables held at their bounds (Schur complement)."""
        active = np.flatnonzero(side)
        bounds = np.where(side[active] > 0, self._upper[active], self._lower[active])
        columns = np.zeros((unbounded.size, active.size))
        columns[active, np.arange(active.size)] = 1.0
        inverse_columns = self._times_inverse(columns)
        multipliers = np.zeros_like(unbounded)
        multipliers[active] = np.linalg.solve(inverse_columns[active], unbounded[active] - bounds)
        x = unbounded - inverse_columns @ multipliers[active]
        x[active] = bounds
        return x, multipliers

    def _times_inverse(self, right: Array) -> Array:
        solution, _ = lapack.dpotrs(self._factor, right, lower=1)
        return np.asarray(solution)

    def _by_dual_active_set(self, gradient: Array) -> QpSolution:
        no_constraints = np.zeros((0, gradient.size))
        x, _, exit_flag, info = daqp.solve(self._hessian, gradient, no_constraints, self._upper, self._lower)
        if exit_flag <= 0 or not np.isfinite(x).all():
            raise QpError(f"the QP was not solved (daqp exit flag {exit_flag})")
        return QpSolution(x, info["lam"], _ITERATIONS_MAX + int(info["iterations"]))
