"""One SQP step as a real-time iteration: prepare before the measurement, feedback after it.

`prepare` linearises around a guess, condenses and factorises. `feedback` embeds the measured states as
deviations from the guess, re-evaluates the residuals in the measured geometry, solves the quadratic program
with bounds on the inputs, and expands. The derivatives by the inputs stay those of the preparation.
"""

from dataclasses import dataclass

import numpy as np

from relform_controller.ocp.cost import CostLinearization, NetAcceleration, TeamCost
from relform_controller.ocp.problem import HorizonReference, Ocp, Plan, TeamGeometry
from relform_controller.solver.dense.box_qp import BoxQp
from relform_controller.solver.dense.condensing import StateMaps, condense
from relform_controller.solver.kernels import Kernels
from relform_core.arrays import Array
from relform_core.controller_config import WeightsConfig


@dataclass(frozen=True, eq=False)
class SqpStep:
    """The outcome of one SQP step."""

    plan: Plan
    kkt: float
    """|gradient . step| + sum |multiplier * active bound| of the QP: the KKT value of ACADO, to which the
    paper's tolerances refer."""
    objective: float
    """Value of eqs. CostFunc1 and CostFunc2 at the new plan, in the Gauss-Newton model of the step."""
    qp_iterations: int
    active_bounds: int


@dataclass(frozen=True, eq=False)
class _PreparedQp:
    guess: Plan
    maps: StateMaps
    cost: CostLinearization
    qp: BoxQp


class RealTimeIteration:
    """The solver of one optimal control problem."""

    def __init__(self, ocp: Ocp, kernels: Kernels) -> None:
        self._ocp = ocp
        self._kernels = kernels
        self._cost = TeamCost(ocp, kernels)
        self._prepared: _PreparedQp | None = None

    def set_weights(self, weights: WeightsConfig) -> None:
        """Weigh the terms of the cost otherwise; what was prepared is void."""
        self._cost.set_weights(weights)
        self._prepared = None

    def prepare(self, guess: Plan, geometry: TeamGeometry) -> None:
        """Linearise, condense and factorise around a guess, in the {mi} frames as predicted.

        Raises:
            QpError: the QP cannot be set up, for instance because the guess is not finite.
        """
        self._prepared = None
        stages = (self._ocp.n_vehicles, self._ocp.n_stages)
        following, A, B, *acceleration = (
            output.reshape(*stages, *output.shape[1:])
            for output in self._kernels.vehicle_stage(guess.states[:, :-1], guess.thrusts)
        )
        maps = condense(A, B, following - guess.states[:, 1:])
        cost = self._cost.linearize(
            guess, geometry, maps, NetAcceleration(*(part.copy() for part in acceleration))
        )
        thrusts = guess.thrusts.reshape(-1)
        hessian = self._cost.hessian(cost.jacobian)
        qp = BoxQp(hessian, self._ocp.thrust_min - thrusts, self._ocp.thrust_max - thrusts)
        self._prepared = _PreparedQp(guess, maps, cost, qp)

    def feedback(
        self,
        initial_states: Array,
        geometry: TeamGeometry,
        reference: HorizonReference,
        applied_thrusts: Array,
    ) -> SqpStep:
        """Solve the prepared problem for what was measured.

        Args:
            initial_states: state of each vehicle in its own {mi}, shape (vehicle, N_STATE).
            geometry: where the {mi} frames are measured to be.
            reference: what to track.
            applied_thrusts: inputs of the interval before the horizon [N], shape (vehicle, N_INPUT).
        Raises:
            QpError: the QP was not solved.
            RuntimeError: nothing was prepared.
        """
        prepared = self._prepared
        if prepared is None:
            raise RuntimeError("feedback() needs a prepare() that succeeded before it")
        guess, cost, weights = prepared.guess, prepared.cost, self._cost.weights
        deviation = prepared.maps.free_response(initial_states - guess.states[:, 0])
        residual = self._cost.residual(cost, deviation, geometry, reference, applied_thrusts)
        gradient = 2.0 * (cost.jacobian.T @ (weights * residual))
        solution = prepared.qp.solve(gradient)
        step = solution.x
        own_steps = step.reshape(self._ocp.n_vehicles, -1)
        deviation = deviation + np.einsum("vkij,vj->vki", prepared.maps.by_inputs, own_steps)
        thrusts = guess.thrusts + step.reshape(guess.thrusts.shape)
        residual = residual + cost.jacobian @ step
        return SqpStep(
            plan=Plan(guess.states + deviation, np.clip(thrusts, self._ocp.thrust_min, self._ocp.thrust_max)),
            kkt=float(abs(gradient @ step) + np.abs(solution.multipliers * step).sum()),
            objective=float(weights @ residual**2),
            qp_iterations=solution.iterations,
            active_bounds=int(np.count_nonzero(solution.multipliers)),
        )
