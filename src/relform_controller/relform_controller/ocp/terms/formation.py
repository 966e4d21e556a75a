"""The formation: position of each target relative to its observer (eqs. CostFunc1 and CostFunc2)."""

import casadi as ca
import numpy as np

from relform_controller.ocp import layout
from relform_controller.ocp.model import rotation_z
from relform_controller.ocp.problem import Ocp, TeamGeometry
from relform_controller.ocp.scaling import formation_scale
from relform_controller.ocp.terms.stages import with_terminal_scale
from relform_controller.ocp.terms.term import ByStates, Derivatives, Expansion, Instance
from relform_core.arrays import Array
from relform_core.controller_config import WeightsConfig

_POSITION_AND_YAW = [*range(layout.N_STATE)[layout.POSITION], layout.YAW]


class Formation:
    """Error of p_B1B2_C1 of every ordered pair, shape (pair, stage 1..N, 3)."""

    name = "formation"
    n_rows = 3
    at_end = True
    is_own = False
    is_constant = False

    def __init__(self, ocp: Ocp) -> None:
        self.n_items = len(ocp.pairs)
        self.functions = [(_pair_stage(), self.n_items * (ocp.n_stages + 1))]
        self._n_stages = ocp.n_stages
        self._observers = np.array([i for i, _ in ocp.pairs])
        self._targets = np.array([j for _, j in ocp.pairs])
        shares = np.array([float(ocp.in_formation_cost(i, j)) for i, j in ocp.pairs])
        self._shares = formation_scale(ocp) * shares

    def weights(self, weights: WeightsConfig) -> Array:
        """See ``Term``; scaled by the size of the team (``scaling``), zero for pairs that are left out."""
        by_stage = with_terminal_scale(weights.formation, weights, self._n_stages)
        return self._shares[:, None, None] * by_stage[:, None]

    def derivatives(self, expansion: Expansion) -> Derivatives:
        """See ``Term``."""
        _, by_observer, by_target = self._evaluate(expansion, expansion.geometry)
        return (
            ByStates(self._observers, _POSITION_AND_YAW, by_observer[:, 1:]),
            ByStates(self._targets, layout.POSITION, by_target[:, 1:]),
        )

    def residual(self, expansion: Expansion, instance: Instance) -> Array:
        """See ``Term``."""
        p_B1B2_C1, by_observer, by_target = self._evaluate(expansion, instance.geometry)
        observer = instance.state_deviation[self._observers][..., _POSITION_AND_YAW]
        target = instance.state_deviation[self._targets][..., layout.POSITION]
        p_B1B2_C1 = (
            p_B1B2_C1
            + np.einsum("pkij,pkj->pki", by_observer, observer)
            + np.einsum("pkij,pkj->pki", by_target, target)
        )
        error: Array = (p_B1B2_C1 - instance.reference.p_B1B2_C1)[:, 1:]
        return error

    def _evaluate(self, expansion: Expansion, geometry: TeamGeometry) -> tuple[Array, Array, Array]:
        """p_B1B2_C1 and its derivatives by observer and target, each of shape (pair, stage 0..N, ...)."""
        states = expansion.guess.states
        observer = states[self._observers][..., _POSITION_AND_YAW]
        target = states[self._targets][..., layout.POSITION]
        frames = np.concatenate([geometry.p_I1I2_I1, geometry.yaw_I1I2[:, None]], axis=1)
        stages = target.shape[:2]
        frames = np.broadcast_to(frames[:, None], (*stages, 4))
        value, by_observer, by_target = expansion.compiled["pair_stage"](observer, target, frames)
        return (
            value.reshape(*stages, 3),
            by_observer.reshape(*stages, 3, 4),
            by_target.reshape(*stages, 3, 3),
        )


def relative_position(
    p_I1B1_I1: ca.SX, yaw_I1B1: ca.SX, p_I2B2_I2: ca.SX, p_I1I2_I1: ca.SX, yaw_I1I2: ca.SX
) -> ca.SX:
    """p_B1B2_C1: position of vehicle 2 relative to vehicle 1 in {mc_1} (eqs. RelPos1 to RelPos4) [m]."""
    R_I1I2 = rotation_z(yaw_I1I2)
    p_I2B2_I1 = R_I1I2 @ p_I2B2_I2  # eq. RelPos1
    p_I1B2_I1 = p_I2B2_I1 + p_I1I2_I1  # eq. RelPos2
    p_B1B2_I1 = p_I1B2_I1 - p_I1B1_I1  # eq. RelPos3
    R_C1I1 = rotation_z(-yaw_I1B1)
    return R_C1I1 @ p_B1B2_I1  # eq. RelPos4


def _pair_stage() -> ca.Function:
    """(p_I1B1_I1 and yaw_I1B1, p_I2B2_I2, p_I1I2_I1 and yaw_I1I2) -> p_B1B2_C1 (3,), its derivatives by the
    first argument (3, 4) and by the second (3, 3)."""
    observer, p_I2B2_I2, frames = ca.SX.sym("observer", 4), ca.SX.sym("target", 3), ca.SX.sym("frames", 4)
    p_B1B2_C1 = relative_position(observer[:3], observer[3], p_I2B2_I2, frames[:3], frames[3])
    outputs = [p_B1B2_C1, ca.jacobian(p_B1B2_C1, observer), ca.jacobian(p_B1B2_C1, p_I2B2_I2)]
    return ca.Function(
        "pair_stage", [observer, p_I2B2_I2, frames], [ca.densify(output) for output in outputs]
    )
