"""The torque of each vehicle (eq. CostFunc1), scaled by its inertia."""

from collections.abc import Sequence

import casadi as ca
import numpy as np

from relform_controller.ocp.model import torque_by_thrusts
from relform_controller.ocp.problem import Ocp
from relform_controller.ocp.scaling import torque_scale
from relform_controller.ocp.terms.term import ByInputs, Derivatives, Expansion, Instance
from relform_core.arrays import Array
from relform_core.controller_config import WeightsConfig


class Torque:
    """I_0 / I tau_B of every vehicle (``scaling``) [N m], shape (vehicle, stage 0..N-1, 3)."""

    name = "torque"
    n_rows = 3
    at_end = False
    is_own = True
    is_constant = True
    functions: Sequence[tuple[ca.Function, int]] = ()

    def __init__(self, ocp: Ocp) -> None:
        self.n_items = ocp.n_vehicles
        self._n_stages = ocp.n_stages
        self._by_thrusts = torque_scale(ocp.body)[:, None] * torque_by_thrusts(ocp.body)
        # One product for all stages: else the last digits would differ from those of recorded flights.
        self._over_horizon = np.kron(np.eye(ocp.n_stages), self._by_thrusts)

    def weights(self, weights: WeightsConfig) -> Array:
        """See ``Term``."""
        return np.full((1, 1, 1), weights.torque)

    def derivatives(self, expansion: Expansion) -> Derivatives:
        """See ``Term``."""
        shape = (self.n_items, self._n_stages, *self._by_thrusts.shape)
        return (ByInputs(np.arange(self.n_items), np.broadcast_to(self._by_thrusts, shape)),)

    def residual(self, expansion: Expansion, instance: Instance) -> Array:
        """See ``Term``."""
        own_thrusts = expansion.guess.thrusts.reshape(self.n_items, -1)
        torques: Array = own_thrusts @ self._over_horizon.T
        return torques.reshape(self.n_items, self._n_stages, self.n_rows)
