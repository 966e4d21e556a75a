"""The residuals of eqs. CostFunc1 and CostFunc2 over the horizon and their derivatives by the inputs.

The cost is sum(weights * residual^2). Stage 0 of the formation and of the leader's pose is left out: no input
changes it.
"""

from dataclasses import dataclass

import casadi as ca
import numpy as np

from relform_controller.ocp import layout
from relform_controller.ocp.frames import rotation_z
from relform_controller.ocp.model import torque_B
from relform_controller.ocp.problem import HorizonReference, Ocp, Plan, TeamGeometry
from relform_controller.solver.dense.condensing import StateMaps
from relform_controller.solver.kernels import Kernels
from relform_core.arrays import Array
from relform_core.controller_config import WeightsConfig

_POSITION_AND_YAW = [0, 1, 2, layout.YAW]


@dataclass(frozen=True, eq=False)
class NetAcceleration:
    """g + R_IB F_B / m of every vehicle at stage 0..N-1 and its derivatives, from the vehicle kernel."""

    value: Array
    """[m/s^2], shape (vehicle, stage, 3)."""
    by_rpy: Array
    """Shape (vehicle, stage, 3, 3)."""
    by_thrusts: Array
    """Shape (vehicle, stage, 3, N_INPUT)."""


@dataclass(frozen=True, eq=False)
class CostLinearization:
    """The residuals around a guess to first order."""

    guess: Plan
    jacobian: Array
    """d residual / d inputs with the states condensed out, shape (row, vehicle * N * N_INPUT)."""
    acceleration: NetAcceleration


class TeamCost:
    """The cost of one optimal control problem."""

    def __init__(self, ocp: Ocp, kernels: Kernels) -> None:
        n, n_stages = ocp.n_vehicles, ocp.n_stages
        self._ocp = ocp
        self._kernels = kernels
        self._observers = np.array([i for i, _ in ocp.pairs])
        self._targets = np.array([j for _, j in ocp.pairs])
        self._n_own = n_stages * layout.N_INPUT
        self._torque_map = np.kron(np.eye(n_stages), _torque_by_thrusts(ocp))
        self._rate_map = np.eye(self._n_own) - np.eye(self._n_own, k=-layout.N_INPUT)

        by_term = _weights_by_term(ocp, ocp.weights)
        ends = np.cumsum([rows.size for rows in by_term.values()])
        self._slices = {
            name: slice(end - rows.size, end) for (name, rows), end in zip(by_term.items(), ends, strict=True)
        }
        self._coupled = slice(0, self._slices["leader_yaw"].stop)
        """Rows of the team and of the leader; those after them concern each vehicle alone."""
        self._constant_jacobian = np.zeros((ends[-1], n * self._n_own))
        for name, own_map in (("torque", self._torque_map), ("thrust_rate", self._rate_map)):
            self._fill_own_rows(self._constant_jacobian, name, np.broadcast_to(own_map, (n, *own_map.shape)))
        self.set_weights(ocp.weights)

    def set_weights(self, weights: WeightsConfig) -> None:
        """Weigh the same residuals otherwise."""
        self.weights = np.concatenate(list(_weights_by_term(self._ocp, weights).values()))
        """Shape (row,)."""
        self._roots = np.sqrt(2.0 * self.weights)[:, None]
        self._acceleration_root = np.sqrt(2.0 * weights.acceleration)
        constant_rows = self._roots * self._constant_jacobian
        self._constant_hessian = constant_rows.T @ constant_rows

    def linearize(
        self, guess: Plan, geometry: TeamGeometry, maps: StateMaps, acceleration: NetAcceleration
    ) -> CostLinearization:
        """Derivatives of all residuals around a guess."""
        n, n_own = self._ocp.n_vehicles, self._n_own
        _, by_observer, by_target = self._pair_terms(guess.states, geometry)
        jacobian = self._constant_jacobian.copy()

        rows = self._rows(jacobian, "formation").reshape(len(self._observers), -1, n, n_own)
        pairs = np.arange(len(self._observers))
        observer_maps = maps.by_inputs[self._observers, 1:][:, :, _POSITION_AND_YAW]
        target_maps = maps.by_inputs[self._targets, 1:, layout.POSITION]
        rows[pairs, :, self._observers] = (by_observer[:, 1:] @ observer_maps).reshape(len(pairs), -1, n_own)
        rows[pairs, :, self._targets] = (by_target[:, 1:] @ target_maps).reshape(len(pairs), -1, n_own)

        leader_maps = maps.by_inputs[0, 1:]
        R_NI = rotation_z(geometry.yaw_NI)
        position_map = R_NI @ leader_maps[:, layout.POSITION]
        self._rows(jacobian, "leader_position")[:, 0] = position_map.reshape(-1, n_own)
        self._rows(jacobian, "leader_yaw")[:, 0] = leader_maps[:, layout.YAW]

        n_input = layout.N_INPUT
        acceleration_map = acceleration.by_rpy @ maps.by_inputs[:, :-1, layout.RPY]
        for k in range(self._ocp.n_stages):
            acceleration_map[:, k, :, k * n_input : (k + 1) * n_input] += acceleration.by_thrusts[:, k]
        self._fill_own_rows(jacobian, "acceleration", acceleration_map.reshape(n, -1, n_own))
        return CostLinearization(guess, jacobian, acceleration)

    def hessian(self, jacobian: Array) -> Array:
        """Gauss-Newton: 2 J' W J, shape (vehicle * N * N_INPUT,) * 2.

        Most rows are constant, or zero but for one vehicle: to use that takes half the time.
        """
        n, vehicles = self._ocp.n_vehicles, np.arange(self._ocp.n_vehicles)
        coupled = self._roots[self._coupled] * jacobian[self._coupled]
        hessian: Array = coupled.T @ coupled + self._constant_hessian
        rows = self._rows(jacobian, "acceleration").reshape(n, -1, n, self._n_own)
        own = self._acceleration_root * rows[vehicles, :, vehicles]
        blocks = hessian.reshape(n, self._n_own, n, self._n_own)
        blocks[vehicles, :, vehicles] += own.swapaxes(1, 2) @ own
        return hessian

    def residual(
        self,
        linearization: CostLinearization,
        state_deviation: Array,
        geometry: TeamGeometry,
        reference: HorizonReference,
        applied_thrusts: Array,
    ) -> Array:
        """Residuals at ``guess + state_deviation``: to first order in it, but exact in the geometry.

        Args:
            linearization: around the guess; its geometry may have been another one.
            state_deviation: shape (vehicle, stage 0..N, N_STATE).
            geometry: where the {mi} frames lie.
            reference: what to track.
            applied_thrusts: inputs of the interval before the horizon [N], shape (vehicle, N_INPUT).
        """
        guess = linearization.guess
        p_B1B2_C1, by_observer, by_target = self._pair_terms(guess.states, geometry)
        observer_deviation = state_deviation[self._observers][..., _POSITION_AND_YAW]
        target_deviation = state_deviation[self._targets][..., layout.POSITION]
        p_B1B2_C1 = (
            p_B1B2_C1
            + np.einsum("pkij,pkj->pki", by_observer, observer_deviation)
            + np.einsum("pkij,pkj->pki", by_target, target_deviation)
        )
        leader = guess.states[0] + state_deviation[0]
        R_NI = rotation_z(geometry.yaw_NI)
        p_NB_N = leader[:, layout.POSITION] @ R_NI.T + geometry.p_NI_N  # eq. Leader_States1
        yaw_NB = leader[:, layout.YAW] + geometry.yaw_NI  # eq. Leader_States3
        acceleration = linearization.acceleration
        rpy_deviation = state_deviation[:, :-1, layout.RPY]
        tilted = np.einsum("vkij,vkj->vki", acceleration.by_rpy, rpy_deviation)
        own_thrusts = guess.thrusts.reshape(self._ocp.n_vehicles, -1)
        thrust_rate = own_thrusts @ self._rate_map.T
        thrust_rate[:, : layout.N_INPUT] -= applied_thrusts
        residuals = {
            "formation": (p_B1B2_C1 - reference.p_B1B2_C1)[:, 1:],
            "leader_position": (p_NB_N - reference.p_NB_N)[1:],
            "leader_yaw": (yaw_NB - reference.yaw_NB)[1:],
            "acceleration": acceleration.value + tilted,
            "torque": own_thrusts @ self._torque_map.T,
            "thrust_rate": thrust_rate,
        }
        return np.concatenate([residuals[name].reshape(-1) for name in self._slices])

    def _pair_terms(self, states: Array, geometry: TeamGeometry) -> tuple[Array, Array, Array]:
        """p_B1B2_C1 and its derivatives by observer and target, each of shape (pair, stage 0..N, ...).

        They live in the kernel's memory until the next call.
        """
        observer = states[self._observers][..., _POSITION_AND_YAW]
        target = states[self._targets][..., layout.POSITION]
        frames = np.concatenate([geometry.p_I1I2_I1, geometry.yaw_I1I2[:, None]], axis=1)
        frames = np.broadcast_to(frames[:, None], (*target.shape[:2], 4))
        value, by_observer, by_target = self._kernels.pair_stage(observer, target, frames)
        stages = target.shape[:2]
        return (
            value.reshape(*stages, 3),
            by_observer.reshape(*stages, 3, 4),
            by_target.reshape(*stages, 3, 3),
        )

    def _rows(self, jacobian: Array, name: str) -> Array:
        """The rows of one term, a view of shape (row, vehicle, own input)."""
        return jacobian[self._slices[name]].reshape(-1, self._ocp.n_vehicles, self._n_own)

    def _fill_own_rows(self, jacobian: Array, name: str, own_maps: Array) -> None:
        """Fill a term that concerns each vehicle alone; own_maps has shape (vehicle, row, own input)."""
        n = self._ocp.n_vehicles
        rows = self._rows(jacobian, name).reshape(n, -1, n, self._n_own)
        rows[np.arange(n), :, np.arange(n)] = own_maps


def _weights_by_term(ocp: Ocp, weights: WeightsConfig) -> dict[str, Array]:
    """The weight of each row of each term, in the order of the rows."""
    n, n_stages = ocp.n_vehicles, ocp.n_stages
    terminal = np.ones(n_stages)
    terminal[-1] = weights.terminal_scale
    pair_shares = np.array([float(ocp.in_formation_cost(i, j)) for i, j in ocp.pairs])
    return {
        "formation": np.kron(pair_shares, np.repeat(weights.formation * terminal, 3)),
        "leader_position": np.repeat(weights.leader_position * terminal, 3),
        "leader_yaw": weights.leader_yaw * terminal,
        "acceleration": np.full(n * n_stages * 3, weights.acceleration),
        "torque": np.full(n * n_stages * 3, weights.torque),
        "thrust_rate": np.full(n * n_stages * layout.N_INPUT, weights.thrust_rate),
    }


def _torque_by_thrusts(ocp: Ocp) -> Array:
    thrusts = ca.SX.sym("thrusts", layout.N_INPUT)
    jacobian = ca.Function("torque", [], [ca.jacobian(torque_B(thrusts, ocp.body), thrusts)])
    return np.array(jacobian()["o0"])
