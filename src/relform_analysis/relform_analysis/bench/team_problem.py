"""The problem of the team in symbols, stage by stage, and the numbers of one instance.

Written for solvers that are not ours, from the model and the terms of the cost alone. The stage state `z`
holds the states of all vehicles, each followed by its commands of the stage before if the cost has them.
"""

import casadi as ca
import numpy as np

from relform_analysis.bench.streams import Instance
from relform_controller.ocp import layout
from relform_controller.ocp.model import net_acceleration_I, rk4_step, rotation_z
from relform_controller.ocp.problem import Ocp
from relform_controller.ocp.terms.term import LeaderStage, PairStage, Terms, VehicleStage
from relform_core.arrays import Array
from relform_core.constraints_config import Prices

_NX, _NU = layout.N_STATE, layout.N_INPUT


class TeamProblem:
    """Dynamics and cost of a stage, as functions of stage state ``z``, commands ``u`` and parameters ``p``.

    Args:
        ocp: the problem, without lag of the rotors.
        terms: of its cost.
    """

    def __init__(self, ocp: Ocp, terms: Terms) -> None:
        self._ocp, self._terms = ocp, terms
        n, n_pairs = ocp.n_vehicles, len(ocp.pairs)
        self._carries_before = ocp.weights.thrust_rate > 0.0
        self._nz = _NX + (_NU if self._carries_before else 0)
        self._disturbances = ca.SX.sym("disturbances", 4, n)
        self._leader_frame = ca.SX.sym("leader_frame", 4)
        self._leader_reference = ca.SX.sym("leader_reference", 4)
        self._pair_frames = ca.SX.sym("pair_frames", 4, n_pairs)
        self._pair_references = ca.SX.sym("pair_references", 3, n_pairs)
        self.z = ca.SX.sym("z", self._nz * n)
        self.u = ca.SX.sym("u", _NU * n)
        parameters = (
            self._disturbances,
            self._leader_frame,
            self._leader_reference,
            self._pair_frames,
            self._pair_references,
        )
        self.p = ca.vertcat(*(ca.vec(part) for part in parameters))
        self.following = self._following()
        """z of the next stage."""
        effort = self._vehicle_residuals()
        self.first_residual = effort
        """Cost of a stage: the sum of squares of its residual. Stage 0."""
        self.residual = ca.vertcat(effort, self._team_residuals(1.0))
        """Stages 1..N-1."""
        self.last_residual = self._team_residuals(ocp.weights.terminal_scale)
        """Stage N."""
        self.excess, self.prices = self._soft_constraints()
        """Soft constraints excess <= 0 of stages 1..N; price and square price of each, shape (row, 2)."""

    def guess(self, instance: Instance) -> tuple[list[Array], list[Array]]:
        """z of stages 0..N, and u of stages 0..N-1, to linearise at."""
        states, thrusts = instance.guess.states, instance.guess.thrusts
        n_stages = thrusts.shape[1]
        before = np.concatenate([instance.start.applied_thrusts[:, None], thrusts], axis=1)
        return (
            [self._stage_state(states[:, k], before[:, k]) for k in range(n_stages + 1)],
            [thrusts[:, k].reshape(-1) for k in range(n_stages)],
        )

    def start(self, instance: Instance) -> Array:
        """z at the start of the horizon, as it is estimated."""
        return self._stage_state(instance.start.states, instance.start.applied_thrusts)

    def parameters(self, instance: Instance) -> list[Array]:
        """p of stages 0..N, with the measured geometry."""
        geometry, reference = instance.geometry, instance.reference
        frames = np.column_stack([geometry.p_I1I2_I1, geometry.yaw_I1I2])
        if geometry.disturbances is None:  # no force, and the nominal thrust
            disturbances = np.tile([0.0, 0.0, 0.0, 1.0], (self._ocp.n_vehicles, 1))
        else:
            disturbances = geometry.disturbances.inputs
        return [
            np.concatenate(
                [
                    disturbances.reshape(-1),
                    geometry.p_NI_N,
                    [geometry.yaw_NI],
                    reference.p_NB_N[k],
                    [reference.yaw_NB[k]],
                    frames.reshape(-1),
                    reference.p_B1B2_C1[:, k].reshape(-1),
                ]
            )
            for k in range(self._ocp.n_stages + 1)
        ]

    def _stage_state(self, states: Array, before: Array) -> Array:
        parts = (states, before) if self._carries_before else (states,)
        return np.concatenate(parts, axis=1).reshape(-1)

    def _of_vehicle(self, i: int) -> tuple[ca.SX, ca.SX, ca.SX]:
        """State, commands of the stage before, and commands of a vehicle."""
        part, commands = self.z[i * self._nz : (i + 1) * self._nz], self.u[i * _NU : (i + 1) * _NU]
        return part[:_NX], part[_NX:] if self._carries_before else commands, commands

    def _following(self) -> ca.SX:
        ocp, parts = self._ocp, []
        for i in range(ocp.n_vehicles):
            state, _, commands = self._of_vehicle(i)
            disturbance = self._disturbances[:, i]
            parts.append(rk4_step(state, disturbance[3] * commands, ocp.body, ocp.stage, disturbance[:3]))
            if self._carries_before:
                parts.append(commands)
        return ca.vertcat(*parts)

    def _vehicle_residuals(self) -> ca.SX:
        ocp, rows = self._ocp, []
        for i in range(ocp.n_vehicles):
            state, before, commands = self._of_vehicle(i)
            disturbance = self._disturbances[:, i]
            acceleration = net_acceleration_I(state, disturbance[3] * commands, ocp.body) + disturbance[:3]
            stage = VehicleStage(state, commands, before, acceleration)
            rows += [
                _weighted(term.weight(ocp, ocp.weights), term.residual(ocp, stage))
                for term in self._terms.vehicle
            ]
        return ca.vertcat(*rows)

    def _team_residuals(self, scale: float) -> ca.SX:
        ocp, weights = self._ocp, self._ocp.weights
        frame, reference = self._leader_frame, self._leader_reference
        leader = LeaderStage(self._of_vehicle(0)[0], frame[:3], frame[3], reference[:3], reference[3])
        rows = [
            _weighted(scale * term.weight(ocp, weights), term.residual(leader)) for term in self._terms.leader
        ]
        for pair, (i, j) in enumerate(ocp.pairs):
            frame = self._pair_frames[:, pair]
            stage = PairStage(
                self._of_vehicle(i)[0],
                self._of_vehicle(j)[0],
                frame[:3],
                frame[3],
                self._pair_references[:, pair],
            )
            rows += [
                _weighted(scale * term.weight(ocp, weights, i, j), term.residual(stage))
                for term in self._terms.pair
            ]
        return ca.vertcat(*rows)

    def _soft_constraints(self) -> tuple[ca.SX, Array]:
        """Of every vehicle, then of every pair, as the solver numbers them."""
        ocp, constraints = self._ocp, self._ocp.constraints
        found: list[tuple[ca.SX, Prices]] = []
        for i in range(ocp.n_vehicles):
            state, frame = self._of_vehicle(i)[0], self._leader_frame
            if i > 0:
                from_leader = self._pair_frames[:, ocp.pairs.index((0, i))]
                p_NI_N = frame[:3] + rotation_z(frame[3]) @ from_leader[:3]
                frame = ca.vertcat(p_NI_N, frame[3] + from_leader[3])
            p_NB_N = frame[:3] + rotation_z(frame[3]) @ state[layout.POSITION]
            found += [(each.excess(state, p_NB_N), each.prices) for each in constraints.vehicle]
        for pair, (i, j) in enumerate(ocp.pairs):
            observer, target = self._of_vehicle(i)[0], self._of_vehicle(j)[0]
            frame = self._pair_frames[:, pair]
            p_I1B2_I1 = frame[:3] + rotation_z(frame[3]) @ target[layout.POSITION]
            p_B1B2_I1 = p_I1B2_I1 - observer[layout.POSITION]
            found += [
                (each.excess(observer, p_B1B2_I1), each.prices)
                for each in constraints.pair
                if (i, j) in each.pairs
            ]
        prices = np.array([(each.price, each.square_price) for _, each in found]).reshape(-1, 2)
        return ca.vertcat(*(excess for excess, _ in found)), prices


def _weighted(weight: float, residual: ca.SX) -> ca.SX:
    return np.sqrt(weight) * residual if weight > 0.0 else ca.SX(0, 1)
