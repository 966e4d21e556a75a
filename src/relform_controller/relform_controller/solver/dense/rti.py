"""One SQP step of Algorithm MRTI by the dense solver.

`prepare` linearises around a guess, condenses and factorises. `feedback` embeds the measured states and
rotor thrusts as deviations from the guess, re-evaluates the residuals in the measured geometry, solves the
quadratic program with bounds on the inputs, and expands. The derivatives by the inputs stay those of the
preparation.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from relform_controller.ocp.problem import HorizonReference, HorizonStart, Ocp, Plan, TeamGeometry
from relform_controller.ocp.terms.term import Expansion, Instance, NetAcceleration, Term
from relform_controller.solver.dense.box_qp import BoxQp
from relform_controller.solver.dense.condensing import StateMaps, condense
from relform_controller.solver.dense.cost import CondensedCost
from relform_controller.solver.kernels import Kernels
from relform_controller.solver.solver import SqpStep
from relform_core.arrays import Array
from relform_core.controller_config import WeightsConfig


@dataclass(frozen=True, eq=False)
class _PreparedQp:
    expansion: Expansion
    maps: StateMaps
    jacobian: Array
    qp: BoxQp


class RealTimeIteration:
    """SQP steps by full condensing (``Solver``).

    Args:
        ocp: the problem.
        terms: of its cost.
        kernels: its compiled functions, those of the terms included.
    """

    def __init__(self, ocp: Ocp, terms: Sequence[Term], kernels: Kernels) -> None:
        self._ocp = ocp
        self._kernels = kernels
        self._cost = CondensedCost(ocp, terms)
        self._prepared: _PreparedQp | None = None

    def set_weights(self, weights: WeightsConfig) -> None:
        """See ``Solver``."""
        self._cost.set_weights(weights)
        self._prepared = None

    def prepare(self, guess: Plan, geometry: TeamGeometry) -> None:
        """See ``Solver``."""
        self._prepared = None
        expansion, maps = expand(self._ocp, self._kernels, guess, geometry)
        jacobian = self._cost.jacobian(expansion, maps)
        thrusts = guess.thrusts.reshape(-1)
        hessian = self._cost.hessian(jacobian)
        qp = BoxQp(hessian, self._ocp.thrust_min - thrusts, self._ocp.thrust_max - thrusts)
        self._prepared = _PreparedQp(expansion, maps, jacobian, qp)

    def feedback(
        self,
        start: HorizonStart,
        geometry: TeamGeometry,
        reference: HorizonReference,
    ) -> SqpStep:
        """See ``Solver``."""
        prepared = self._prepared
        if prepared is None:
            raise RuntimeError("feedback() needs a prepare() that succeeded before it")
        guess, jacobian, weights = prepared.expansion.guess, prepared.jacobian, self._cost.weights
        rotor_deviation = start.rotors.thrusts - guess.rotors.thrusts
        deviation = prepared.maps.free_response(start.states - guess.states[:, 0], rotor_deviation)
        mean_thrust_deviation = None
        if (lag := guess.rotors.lag.over_horizon(self._ocp.n_stages, self._ocp.stage)) is not None:
            mean_thrust_deviation = lag.mean_thrusts(np.zeros_like(guess.thrusts), rotor_deviation)
        residual = self._cost.residual(
            prepared.expansion,
            Instance(deviation, geometry, reference, start.applied_thrusts, mean_thrust_deviation),
        )
        gradient = 2.0 * (jacobian.T @ (weights * residual))
        solution = prepared.qp.solve(gradient)
        step = solution.x
        own_steps = step.reshape(self._ocp.n_vehicles, -1)
        deviation = deviation + np.einsum("vkij,vj->vki", prepared.maps.by_inputs, own_steps)
        thrusts = guess.thrusts + step.reshape(guess.thrusts.shape)
        residual = residual + jacobian @ step
        return SqpStep(
            plan=Plan(
                guess.states + deviation,
                np.clip(thrusts, self._ocp.thrust_min, self._ocp.thrust_max),
                start.rotors,
            ),
            kkt=float(abs(gradient @ step) + np.abs(solution.multipliers * step).sum()),
            objective=float(weights @ residual**2),
            qp_iterations=solution.iterations,
            active_bounds=int(np.count_nonzero(solution.multipliers)),
        )


def expand(ocp: Ocp, kernels: Kernels, guess: Plan, geometry: TeamGeometry) -> tuple[Expansion, StateMaps]:
    """The model along a guess, linearised for the terms and condensed."""
    stages = (ocp.n_vehicles, ocp.n_stages)
    lag = guess.rotors.lag.over_horizon(ocp.n_stages, ocp.stage)
    mean_thrusts = guess.thrusts if lag is None else lag.mean_thrusts(guess.thrusts, guess.rotors.thrusts)
    disturbances: tuple[Array, ...] = ()
    if geometry.disturbances is not None:
        disturbances = (np.repeat(geometry.disturbances.inputs[:, None], ocp.n_stages, axis=1),)
    following, A, B, *acceleration = (
        output.reshape(*stages, *output.shape[1:])
        for output in kernels.vehicle_stage(guess.states[:, :-1], mean_thrusts, *disturbances)
    )
    maps = condense(A, B, following - guess.states[:, 1:])
    if lag is not None:
        maps = maps.through(lag)
    net_acceleration = NetAcceleration(*(part.copy() for part in acceleration))
    return Expansion(guess, geometry, net_acceleration, kernels.of_terms), maps
