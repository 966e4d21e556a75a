"""One SQP step of Algorithm MRTI in NumPy: any team, any horizon, no tricks.

`prepare` makes the quadratic program of a guess and factorises it. `feedback` embeds the measurement, the
gradient and the deviation of the start, and minimises. This is what the fast solver (``kernel``) computes; it
tests that one, and stands in for it where there is no compiler.
"""

import dataclasses
import math
from dataclasses import dataclass

import numpy as np

from relform_controller.ocp import layout
from relform_controller.ocp.problem import HorizonReference, HorizonStart, Ocp, Plan, TeamGeometry
from relform_controller.ocp.terms.term import Terms
from relform_controller.solver import active_set, interior_point
from relform_controller.solver.active_set import Minimiser, Sides
from relform_controller.solver.linearization import Linearization
from relform_controller.solver.riccati import Factors, factorize
from relform_controller.solver.solver import QpError, SqpStep
from relform_controller.solver.stages import STATE, stage_state_size
from relform_controller.solver.team_qp import TeamQp, about, free_response, soft_rows
from relform_core.arrays import Array
from relform_core.controller_config import WeightsConfig


@dataclass(frozen=True, eq=False)
class _Prepared:
    guess: Plan
    qp: TeamQp
    sides: Sides
    factors: Factors


class ReferenceSolver:
    """SQP steps in NumPy (``Solver``).

    Args:
        ocp: the problem.
        terms: of its cost.
    """

    def __init__(self, ocp: Ocp, terms: Terms) -> None:
        self._ocp = ocp
        self._linearization = Linearization(ocp, terms)
        self._prepared: _Prepared | None = None

    def set_weights(self, weights: WeightsConfig) -> None:
        """See ``Solver``."""
        self._linearization.set_weights(weights)
        self._prepared = None

    def prepare(self, guess: Plan, geometry: TeamGeometry) -> None:
        """See ``Solver``."""
        self._prepared = None
        qp = self._linearization.prepare(guess, geometry)
        sides = active_set.predicted_sides(qp)
        self._prepared = _Prepared(guess, qp, sides, factorize(qp, sides == 0))

    def feedback(self, start: HorizonStart, geometry: TeamGeometry, reference: HorizonReference) -> SqpStep:
        """See ``Solver``."""
        prepared = self._prepared
        if prepared is None:
            raise RuntimeError("feedback() needs a prepare() that succeeded before it")
        guess = prepared.guess
        q, cost = self._linearization.gradient(guess, geometry, reference)
        C, c = self._linearization.rows(guess, geometry)
        whole = dataclasses.replace(
            prepared.qp, q=prepared.qp.q + q, constant=prepared.qp.constant + cost, C=C, c=c
        )
        dz0 = self._linearization.start_deviation(guess, start)
        if not (np.isfinite(q).all() and np.isfinite(dz0).all()):
            raise QpError("the gradient is not finite")
        free = free_response(whole, dz0)
        qp = about(whole, free)
        found = active_set.solve(qp, prepared.factors, prepared.sides)
        if found is None or (soft_rows(qp, found.trajectory.dz) > 0.0).any():
            found = interior_point.solve(qp)
        step = SqpStep(
            plan=self._plan(guess, start, free + found.trajectory.dz, found.trajectory.du),
            kkt=kkt(qp, found),
            objective=objective(qp, found),
            qp_iterations=found.iterations,
            active_bounds=int(np.count_nonzero(found.sides)),
            active_constraints=self._ocp.constraints.active(found.active_rows),
        )
        if not (math.isfinite(step.kkt) and math.isfinite(step.objective)):
            raise QpError("the gradient is not finite")
        return step

    def _plan(self, guess: Plan, start: HorizonStart, dz: Array, du: Array) -> Plan:
        n, N, nz = self._ocp.n_vehicles, self._ocp.n_stages, stage_state_size(self._ocp)
        d_states = dz.reshape(N + 1, n, nz)[..., STATE].swapaxes(0, 1)
        d_thrusts = du.reshape(N, n, layout.N_INPUT).swapaxes(0, 1)
        thrusts = np.clip(guess.thrusts + d_thrusts, self._ocp.thrust_min, self._ocp.thrust_max)
        return Plan(guess.states + d_states, thrusts, start.rotors)


def objective(qp: TeamQp, found: Minimiser) -> float:
    """Cost of the quadratic program at its minimiser."""
    dz, du = found.trajectory.dz, found.trajectory.du
    sigma = np.maximum(soft_rows(qp, dz), 0.0)
    return float(
        qp.constant
        + np.einsum("ki,ki", qp.q + 0.5 * np.einsum("kij,kj->ki", qp.Q, dz), dz)
        + np.einsum("ki,ki", qp.r + 0.5 * np.einsum("kij,kj->ki", qp.R, du), du)
        + np.einsum("ki,kij,kj", du, qp.S, dz[:-1])
        + np.sum(sigma * (qp.linear_price + 0.5 * qp.square_price * sigma))
    )


def kkt(qp: TeamQp, found: Minimiser) -> float:
    """|gradient . step| + sum |multiplier * active bound| of the QP in commands and violations (``SqpStep``).

    The gradient is that at du = 0, where the states follow the dynamics freely; with it go the violations
    sigma there. dz is linear in du, so the derivative along the step is that of both.
    """
    dz, du, slope = found.trajectory.dz, found.trajectory.du, found.trajectory.slope
    at_first, sigma = np.maximum(qp.c, 0.0), np.maximum(soft_rows(qp, dz), 0.0)
    by_sigma = qp.linear_price + qp.square_price * at_first
    change = np.sum(qp.q * dz) + np.sum(qp.r * du) + np.sum(by_sigma * (sigma - at_first))
    at_soft = found.soft * (qp.c - at_first)
    return float(abs(change) + np.abs(slope * du).sum() + np.abs(at_soft).sum())
