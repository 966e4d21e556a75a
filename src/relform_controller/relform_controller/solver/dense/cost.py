"""The terms of the cost with the states condensed out: residuals and their derivatives by all inputs."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from relform_controller.ocp import layout
from relform_controller.ocp.problem import Ocp
from relform_controller.ocp.terms.term import ByMeanThrusts, ByStates, Expansion, Instance, Term
from relform_controller.solver.dense.condensing import StateMaps
from relform_core.arrays import Array
from relform_core.controller_config import WeightsConfig


@dataclass(frozen=True)
class _Rows:
    """The rows of one term."""

    term: Term
    rows: slice

    def of(self, array: Array, *shape: int) -> Array:
        """A view of the rows of a stacked array, shape (item, ...)."""
        return array[self.rows].reshape(self.term.n_items, *shape)


class CondensedCost:
    """The sum of weights * residual^2. The rows run over terms, then items, stages and residuals of each.

    Own terms of the vehicles come last; within both groups the order is the one given.
    """

    def __init__(self, ocp: Ocp, terms: Sequence[Term]) -> None:
        self._n = ocp.n_vehicles
        self._n_stages = ocp.n_stages
        self._n_own = ocp.n_stages * layout.N_INPUT
        self._stage = ocp.stage
        self._all: list[_Rows] = []
        end = 0
        for term in sorted(terms, key=lambda term: term.is_own):
            begin, end = end, end + term.n_items * ocp.n_stages * term.n_rows
            self._all.append(_Rows(term, slice(begin, end)))
        self._n_rows = end
        self._coupled = slice(
            0, max((each.rows.stop for each in self._all if not each.term.is_own), default=0)
        )
        self._constant_jacobian: Array | None = None
        self._constant_hessian: Array | None = None
        self.set_weights(ocp.weights)

    def set_weights(self, weights: WeightsConfig) -> None:
        """Change the weights of the same residuals."""
        self.weights = np.zeros(self._n_rows)
        """Shape (row,)."""
        for each in self._all:
            each.of(self.weights, self._n_stages, each.term.n_rows)[...] = each.term.weights(weights)
        self._roots = np.sqrt(2.0 * self.weights)[:, None]
        self._constant_hessian = None

    def jacobian(self, expansion: Expansion, maps: StateMaps) -> Array:
        """Derivatives of all residuals by all inputs, shape (row, vehicle * N * N_INPUT)."""
        if self._constant_jacobian is None:
            self._constant_jacobian = np.zeros((self._n_rows, self._n * self._n_own))
            for each in self._all:
                if each.term.is_constant:
                    self._fill(self._constant_jacobian, each, expansion, maps)
        jacobian = self._constant_jacobian.copy()
        for each in self._all:
            if not each.term.is_constant:
                self._fill(jacobian, each, expansion, maps)
        return jacobian

    def hessian(self, jacobian: Array) -> Array:
        """Gauss-Newton: 2 J' W J, shape (vehicle * N * N_INPUT,) * 2.

        Constant rows are multiplied once, and rows of one vehicle fill its own block: this halves the time.
        """
        assert self._constant_jacobian is not None
        if self._constant_hessian is None:
            constant_rows = self._roots * self._constant_jacobian
            self._constant_hessian = constant_rows.T @ constant_rows
        coupled = self._roots[self._coupled] * jacobian[self._coupled]
        hessian: Array = coupled.T @ coupled + self._constant_hessian
        blocks = hessian.reshape(self._n, self._n_own, self._n, self._n_own)
        vehicles = np.arange(self._n)
        for each in self._all:
            if each.term.is_own and not each.term.is_constant:
                rows = each.of(jacobian, -1, self._n, self._n_own)
                own = each.of(self._roots, -1, 1) * rows[vehicles, :, vehicles]
                blocks[vehicles, :, vehicles] += own.swapaxes(1, 2) @ own
        return hessian

    def residual(self, expansion: Expansion, instance: Instance) -> Array:
        """All residuals of an instance, to first order in the deviation of its states, shape (row,)."""
        return np.concatenate([each.term.residual(expansion, instance).reshape(-1) for each in self._all])

    def _fill(self, jacobian: Array, each: _Rows, expansion: Expansion, maps: StateMaps) -> None:
        """Add the derivatives of one term to its rows, which are zero before."""
        term, items = each.term, np.arange(each.term.n_items)
        rows = each.of(jacobian, self._n_stages, term.n_rows, self._n, self._n_own)
        rows_by_stage = rows.reshape(*rows.shape[:-1], self._n_stages, layout.N_INPUT)
        stages = slice(1, None) if term.at_end else slice(None, -1)
        horizon_lag = expansion.guess.rotors.lag.over_horizon(self._n_stages, self._stage)
        for block in term.derivatives(expansion):
            if isinstance(block, ByStates):
                state_maps = maps.by_inputs[:, stages, block.components][block.vehicles]
                rows[items, :, :, block.vehicles] = block.values @ state_maps
            elif isinstance(block, ByMeanThrusts) and horizon_lag is not None:
                of_stages = horizon_lag.by_commands.reshape(self._n_stages, layout.N_INPUT, self._n_own)
                rows[items, :, :, block.vehicles] += block.values @ of_stages
            else:
                lag = 0 if isinstance(block, ByMeanThrusts) else block.lag
                later = np.arange(lag, self._n_stages)
                place = (items[:, None], later, slice(None), block.vehicles[:, None], later - lag)
                rows_by_stage[place] += block.values[:, later]
