"""The change of each rotor's thrust from one interval to the next; not in the paper."""

from collections.abc import Sequence

import casadi as ca
import numpy as np

from relform_controller.ocp import layout
from relform_controller.ocp.problem import Ocp
from relform_controller.ocp.terms.term import ByInputs, ByStates, Expansion, Instance
from relform_core.arrays import Array
from relform_core.controller_config import WeightsConfig


class ThrustRate:
    """Thrusts minus those of the interval before [N], shape (vehicle, stage 0..N-1, N_INPUT)."""

    name = "thrust_rate"
    n_rows = layout.N_INPUT
    at_end = False
    is_own = True
    is_constant = True
    functions: Sequence[tuple[ca.Function, int]] = ()

    def __init__(self, ocp: Ocp) -> None:
        self.n_items = ocp.n_vehicles
        self._n_stages = ocp.n_stages

    def weights(self, weights: WeightsConfig) -> Array:
        """See ``Term``."""
        return np.full((1, 1, 1), weights.thrust_rate)

    def derivatives(self, expansion: Expansion) -> Sequence[ByStates | ByInputs]:
        """See ``Term``."""
        vehicles = np.arange(self.n_items)
        one = np.broadcast_to(np.eye(layout.N_INPUT), (self.n_items, self._n_stages, *(layout.N_INPUT,) * 2))
        return (ByInputs(vehicles, one), ByInputs(vehicles, -one, lag=1))

    def residual(self, expansion: Expansion, instance: Instance) -> Array:
        """See ``Term``."""
        thrusts = expansion.guess.thrusts
        return np.diff(thrusts, axis=1, prepend=instance.applied_thrusts[:, None])
