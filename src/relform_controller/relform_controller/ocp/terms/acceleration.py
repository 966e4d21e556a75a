"""The net acceleration of each vehicle, zero at hover (the force term of eq. CostFunc1, divided by mass)."""

from collections.abc import Sequence

import casadi as ca
import numpy as np

from relform_controller.ocp.model import states_of_acceleration
from relform_controller.ocp.problem import Ocp
from relform_controller.ocp.terms.term import ByMeanThrusts, ByStates, Derivatives, Expansion, Instance
from relform_core.arrays import Array
from relform_core.controller_config import WeightsConfig


class Acceleration:
    """g + R_IB F_B / m of every vehicle, shape (vehicle, stage 0..N-1, 3)."""

    name = "acceleration"
    n_rows = 3
    at_end = False
    is_own = True
    is_constant = False
    functions: Sequence[tuple[ca.Function, int]] = ()

    def __init__(self, ocp: Ocp) -> None:
        self.n_items = ocp.n_vehicles
        self._vehicles = np.arange(ocp.n_vehicles)
        self._states = states_of_acceleration(ocp.body)

    def weights(self, weights: WeightsConfig) -> Array:
        """See ``Term``."""
        return np.full((1, 1, 1), weights.acceleration)

    def derivatives(self, expansion: Expansion) -> Derivatives:
        """See ``Term``."""
        acceleration = expansion.acceleration
        return (
            ByStates(self._vehicles, self._states, acceleration.by_states),
            ByMeanThrusts(self._vehicles, acceleration.by_thrusts),
        )

    def residual(self, expansion: Expansion, instance: Instance) -> Array:
        """See ``Term``."""
        deviation = instance.state_deviation[:, :-1, self._states]
        moved = np.einsum("vkij,vkj->vki", expansion.acceleration.by_states, deviation)
        residual: Array = expansion.acceleration.value + moved
        if instance.mean_thrust_deviation is not None:
            by_thrusts = expansion.acceleration.by_thrusts
            residual += np.einsum("vkij,vkj->vki", by_thrusts, instance.mean_thrust_deviation)
        return residual
