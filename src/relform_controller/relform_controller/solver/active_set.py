"""A primal-dual active-set method on the bounds of the commands (Hintermueller, Ito and Kunisch, 2003).

It guesses which bounds are active, minimises with these commands fixed, and corrects the guess: a fixed
command whose cost falls towards the inside is freed, a free one beyond a bound is fixed there. If nothing
changes, the minimiser is that of the quadratic program.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from relform_controller.solver.riccati import Factors, Trajectory, factorize, minimize
from relform_controller.solver.team_qp import TeamQp
from relform_core.arrays import Array, Mask

ITERATIONS_MAX = 8
"""The method may cycle."""
TOLERANCE = 1e-9
"""How far beyond a bound a free command may lie [N]."""

Sides = npt.NDArray[np.int8]
"""Of each command: -1 at its lower bound, 1 at its upper one, 0 free; shape (stage, nu)."""


@dataclass(frozen=True, eq=False)
class Minimiser:
    """A minimiser of the quadratic program."""

    trajectory: Trajectory
    sides: Sides
    iterations: int
    soft: Array
    """Multipliers of the soft constraints, shape (stage 1..N, row)."""
    active_rows: Mask
    """Which soft constraints are active, shape (stage 1..N, row)."""


def predicted_sides(qp: TeamQp) -> Sides:
    """Bounds on which the guess lies: in a shifted plan those that were active one step before."""
    return (qp.upper <= TOLERANCE).astype(np.int8) - (qp.lower >= -TOLERANCE)


def solve(qp: TeamQp, factors: Factors, sides: Sides) -> Minimiser | None:
    """The minimiser, or None if the method does not settle.

    Args:
        qp: the quadratic program, without gaps.
        factors: for the commands that are free in the first guess.
        sides: the first guess.
    """
    for iteration in range(1, ITERATIONS_MAX + 1):
        trajectory = minimize(qp, factors, np.where(sides > 0, qp.upper, qp.lower))
        kept = np.where(trajectory.slope * sides < 0.0, sides, 0)
        beyond = (trajectory.du > qp.upper + TOLERANCE).astype(np.int8)
        beyond -= trajectory.du < qp.lower - TOLERANCE
        corrected = np.where(sides == 0, beyond, kept).astype(np.int8)
        if np.array_equal(corrected, sides):
            return Minimiser(
                trajectory, sides, iteration, np.zeros_like(qp.c), np.zeros(qp.c.shape, dtype=bool)
            )
        sides = corrected
        factors = factorize(qp, sides == 0)
    return None
