"""A primal-dual interior-point method (Mehrotra, 1992) on the Riccati recursion.

It solves the whole quadratic program, soft constraints included. Each constraint has a slack s > 0 and a
multiplier m > 0 with s m = 0 at the solution: upper - du and du - lower of the bounds; for a soft constraint
h = C dz + c <= sigma these are sigma - h and sigma. A Newton step towards s m = target gives

    m+ = (target - product) / s - (m / s) (s+ - s),

linear in dz and du, so that a step minimises the quadratic program with a larger Hessian and another
gradient. `product` is that of the changes of s and m in a first step towards zero. All iterates obey the
dynamics, and slacks follow from them. A step is computed as the changes of dz and du: the weights m / s of
active constraints become so large that they would amplify the rounding errors of dz and du themselves.
"""

import dataclasses
from dataclasses import dataclass

import numpy as np

from relform_controller.solver.active_set import Minimiser
from relform_controller.solver.riccati import Trajectory, factorize, minimize
from relform_controller.solver.solver import QpError
from relform_controller.solver.team_qp import TeamQp, gradient, soft_rows
from relform_core.arrays import Array

ITERATIONS_MAX = 60
COMPLEMENTARITY = 1e-15
"""Mean product of slacks and multipliers at the end, relative to one plus that at the start."""
COMPLEMENTARITY_ACCEPTED = 1e-9
"""The same where rounding errors prevent a better solution."""
STEP_BACK = 0.995
"""Part of the way to the first slack or multiplier that becomes zero."""


_Four = tuple[Array, Array, Array, Array]
"""Of upper and lower bounds, shape (stage, nu); of h <= sigma and of sigma >= 0, shape (stage 1..N, row)."""


@dataclass(frozen=True, eq=False)
class _Point:
    """An iterate. Slacks are part of it: differences would lose their digits close to the bounds."""

    dz: Array
    du: Array
    slacks: _Four
    multipliers: _Four

    def moved(self, to: "_Point", length: float) -> "_Point":
        """The point on the way to another."""

        def between(a: Array, b: Array) -> Array:
            return a + length * (b - a)

        def all_between(a: _Four, b: _Four) -> _Four:
            upper, lower, soft, violation = map(between, a, b)
            return upper, lower, soft, violation

        return _Point(
            between(self.dz, to.dz),
            between(self.du, to.du),
            all_between(self.slacks, to.slacks),
            all_between(self.multipliers, to.multipliers),
        )


def solve(qp: TeamQp) -> Minimiser:
    """The minimiser of a quadratic program without gaps.

    Raises:
        QpError: the method does not converge.
    """
    at = _start(qp)
    scale = 1.0 + _complementarity(at)
    iterations = 0
    while iterations < ITERATIONS_MAX and _complementarity(at) >= COMPLEMENTARITY * scale:
        try:
            at = _iterated(qp, at)
        except QpError:
            break
        iterations += 1
    if _complementarity(at) < COMPLEMENTARITY_ACCEPTED * scale:
        return _minimiser(qp, at, iterations)
    raise QpError("the interior-point method did not converge")


def _iterated(qp: TeamQp, at: _Point) -> _Point:
    """The next iterate: a first step shows how far the products can fall, a second one corrects it."""
    complementarity = _complementarity(at)
    ahead = _step(qp, at, 0.0, (0.0, 0.0, 0.0, 0.0))
    reachable = at.moved(ahead, _longest(at, ahead))
    target = complementarity * (_complementarity(reachable) / complementarity) ** 3
    slack_changes = map(np.subtract, ahead.slacks, at.slacks)
    changes = map(np.subtract, ahead.multipliers, at.multipliers)
    products = tuple(ds * dm for ds, dm in zip(slack_changes, changes, strict=True))
    to = _step(qp, at, target, products)
    return at.moved(to, min(1.0, STEP_BACK * _longest(at, to)))


def _start(qp: TeamQp) -> _Point:
    """Commands well inside their bounds, and multipliers of the size of the gradient."""
    margin = 0.1 * (qp.upper - qp.lower)
    du = np.clip(0.0, qp.lower + margin, qp.upper - margin)
    dz = [np.zeros_like(qp.q[0])]
    for A, B, u in zip(qp.A, qp.B, du, strict=True):
        dz.append(A @ dz[-1] + B @ u)
    states = np.array(dz)
    rows = soft_rows(qp, states)
    sigma = 1.0 + np.maximum(rows, 0.0)
    price = 0.5 * (qp.linear_price + qp.square_price * sigma)
    size = np.full_like(du, 1.0 + np.abs(qp.r).mean())
    slacks = qp.upper - du, du - qp.lower, sigma - rows, sigma
    return _Point(states, du, slacks, (size, size, price, price))


def _step(qp: TeamQp, at: _Point, target: float, products: tuple[Array | float, ...]) -> _Point:
    """Where a Newton step leads."""
    (s_upper, s_lower, t, sigma), (m_upper, m_lower, m_soft, m_sigma) = at.slacks, at.multipliers
    # Without its own change, the next multiplier of each constraint; and how it falls with the slack.
    upper, lower, soft, violation = (
        (target - product) / s for product, s in zip(products, at.slacks, strict=True)
    )
    by_upper, by_lower, by_soft, by_sigma = m_upper / s_upper, m_lower / s_lower, m_soft / t, m_sigma / sigma
    # Stationarity in sigma: linear_price + square_price sigma+ = m_soft+ + m_sigma+.
    stiffness = qp.square_price + by_soft + by_sigma
    excess = soft + violation - qp.linear_price - qp.square_price * sigma
    weight = by_soft * (qp.square_price + by_sigma) / stiffness
    offset = soft - by_soft / stiffness * excess
    R, Q = qp.R.copy(), qp.Q.copy()
    diagonal = np.arange(R.shape[-1])
    R[:, diagonal, diagonal] += by_upper + by_lower
    Q[1:] += np.einsum("kmi,km,kmj->kij", qp.C, weight, qp.C)
    q, r = gradient(qp, at.dz, at.du)
    q[1:] += np.einsum("kmi,km->ki", qp.C, offset)
    r += upper - lower
    barrier = dataclasses.replace(qp, Q=Q, R=R, q=q, r=r)
    factors = factorize(barrier, np.ones(r.shape, dtype=bool))
    change = minimize(barrier, factors, np.zeros_like(r))
    d_rows = np.einsum("kmz,kz->km", qp.C, change.dz[1:])
    d_sigma = (excess + by_soft * d_rows) / stiffness
    multipliers = (
        upper + by_upper * change.du,
        lower - by_lower * change.du,
        offset + weight * d_rows,
        violation - by_sigma * d_sigma,
    )
    slacks = s_upper - change.du, s_lower + change.du, t + d_sigma - d_rows, sigma + d_sigma
    return _Point(at.dz + change.dz, at.du + change.du, slacks, multipliers)


def _longest(at: _Point, to: _Point) -> float:
    """Part of the way at which the first slack or multiplier becomes zero."""
    length = 1.0
    before, after = at.slacks + at.multipliers, to.slacks + to.multipliers
    for a, b in zip(before, after, strict=True):
        falls = b < 0.0
        length = min(length, float(np.min(a[falls] / (a[falls] - b[falls]), initial=1.0)))
    return length


def _complementarity(at: _Point) -> float:
    """Mean product of slacks and multipliers."""
    products = [(s * m).reshape(-1) for s, m in zip(at.slacks, at.multipliers, strict=True)]
    return float(np.concatenate(products).mean())


def _minimiser(qp: TeamQp, at: _Point, iterations: int) -> Minimiser:
    s_upper, s_lower, s_soft, _ = at.slacks
    m_upper, m_lower, m_soft, _ = at.multipliers
    sides = (m_upper > s_upper).astype(np.int8) - (m_lower > s_lower)
    slope = np.where(sides != 0, m_lower - m_upper, 0.0)
    return Minimiser(Trajectory(at.dz, at.du, slope), sides, iterations, m_soft, m_soft > s_soft)
