"""The change of each rotor's thrust from one interval to the next; not in the paper."""

from collections.abc import Sequence

import casadi as ca
import numpy as np

from relform_controller.ocp import layout
from relform_controller.ocp.problem import Ocp
from relform_controller.ocp.scaling import thrust_scale
from relform_controller.ocp.terms.term import ByInputs, Derivatives, Expansion, Instance
from relform_core.arrays import Array
from relform_core.controller_config import WeightsConfig


class ThrustRate:
    """Thrusts minus those of the interval before, scaled by G_0^-1 G (``scaling``) [N].

    Shape (vehicle, stage 0..N-1, N_INPUT).
    """

    name = "thrust_rate"
    n_rows = layout.N_INPUT
    at_end = False
    is_own = True
    is_constant = True
    functions: Sequence[tuple[ca.Function, int]] = ()

    def __init__(self, ocp: Ocp) -> None:
        self.n_items = ocp.n_vehicles
        self._n_stages = ocp.n_stages
        self._scale = thrust_scale(ocp.body)

    def weights(self, weights: WeightsConfig) -> Array:
        """See ``Term``."""
        return np.full((1, 1, 1), weights.thrust_rate)

    def derivatives(self, expansion: Expansion) -> Derivatives:
        """See ``Term``."""
        vehicles = np.arange(self.n_items)
        by_change = np.broadcast_to(self._scale, (self.n_items, self._n_stages, *self._scale.shape))
        return (ByInputs(vehicles, by_change), ByInputs(vehicles, -by_change, lag=1))

    def residual(self, expansion: Expansion, instance: Instance) -> Array:
        """See ``Term``."""
        thrusts = expansion.guess.thrusts
        change: Array = np.diff(thrusts, axis=1, prepend=instance.applied_thrusts[:, None]) @ self._scale.T
        return change
