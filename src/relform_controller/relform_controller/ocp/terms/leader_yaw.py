"""The leader along its heading: yaw in the world (eqs. CostFunc1 and CostFunc2)."""

from collections.abc import Sequence

import casadi as ca
import numpy as np

from relform_controller.ocp import layout
from relform_controller.ocp.problem import Ocp
from relform_controller.ocp.scaling import leader_scale
from relform_controller.ocp.terms.stages import with_terminal_scale
from relform_controller.ocp.terms.term import ByStates, Derivatives, Expansion, Instance
from relform_core.arrays import Array
from relform_core.controller_config import WeightsConfig


class LeaderYaw:
    """Error of yaw_NB of the leader, shape (1, stage 1..N, 1)."""

    name = "leader_yaw"
    n_items = 1
    n_rows = 1
    at_end = True
    is_own = False
    is_constant = False
    functions: Sequence[tuple[ca.Function, int]] = ()

    def __init__(self, ocp: Ocp) -> None:
        self._n_stages = ocp.n_stages
        self._scale = leader_scale(ocp)

    def weights(self, weights: WeightsConfig) -> Array:
        """See ``Term``; scaled by the size of the team (``scaling``)."""
        by_stage = with_terminal_scale(weights.leader_yaw, weights, self._n_stages)
        return self._scale * by_stage[None, :, None]

    def derivatives(self, expansion: Expansion) -> Derivatives:
        """See ``Term``."""
        return (ByStates(np.array([0]), [layout.YAW], np.ones((1, self._n_stages, 1, 1))),)

    def residual(self, expansion: Expansion, instance: Instance) -> Array:
        """See ``Term``."""
        leader = expansion.guess.states[0] + instance.state_deviation[0]
        yaw_NB = leader[:, layout.YAW] + instance.geometry.yaw_NI  # eq. Leader_States3
        error: Array = (yaw_NB - instance.reference.yaw_NB)[None, 1:, None]
        return error
