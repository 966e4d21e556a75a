"""The leader on its path: position in the world (eqs. CostFunc1 and CostFunc2)."""

from collections.abc import Sequence

import casadi as ca
import numpy as np

from relform_controller.ocp import layout
from relform_controller.ocp.frames import rotation_z
from relform_controller.ocp.problem import Ocp
from relform_controller.ocp.scaling import leader_scale
from relform_controller.ocp.terms.stages import with_terminal_scale
from relform_controller.ocp.terms.term import ByStates, Derivatives, Expansion, Instance
from relform_core.arrays import Array
from relform_core.controller_config import WeightsConfig


class LeaderPosition:
    """Error of p_NB_N of the leader, shape (1, stage 1..N, 3)."""

    name = "leader_position"
    n_items = 1
    n_rows = 3
    at_end = True
    is_own = False
    is_constant = False
    functions: Sequence[tuple[ca.Function, int]] = ()

    def __init__(self, ocp: Ocp) -> None:
        self._n_stages = ocp.n_stages
        self._scale = leader_scale(ocp)

    def weights(self, weights: WeightsConfig) -> Array:
        """See ``Term``; scaled by the size of the team (``scaling``)."""
        by_stage = with_terminal_scale(weights.leader_position, weights, self._n_stages)
        return self._scale * by_stage[None, :, None]

    def derivatives(self, expansion: Expansion) -> Derivatives:
        """See ``Term``."""
        R_NI = rotation_z(expansion.geometry.yaw_NI)
        by_position = np.broadcast_to(R_NI, (1, self._n_stages, 3, 3))
        return (ByStates(np.array([0]), layout.POSITION, by_position),)

    def residual(self, expansion: Expansion, instance: Instance) -> Array:
        """See ``Term``."""
        leader, geometry = expansion.guess.states[0] + instance.state_deviation[0], instance.geometry
        R_NI = rotation_z(geometry.yaw_NI)
        p_NB_N = leader[:, layout.POSITION] @ R_NI.T + geometry.p_NI_N  # eq. Leader_States1
        error: Array = (p_NB_N - instance.reference.p_NB_N)[None, 1:]
        return error
