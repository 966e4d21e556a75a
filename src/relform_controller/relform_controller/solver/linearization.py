"""The quadratic program of a guess, in NumPy, from the functions of a stage (``stages``)."""

from collections.abc import Callable
from dataclasses import dataclass

import casadi as ca
import numpy as np

from relform_controller.compiled import Kernel
from relform_controller.ocp import layout
from relform_controller.ocp.frames import rotation_z
from relform_controller.ocp.problem import HorizonReference, HorizonStart, Ocp, Plan, TeamGeometry
from relform_controller.ocp.terms.term import Terms
from relform_controller.solver.stages import (
    BEFORE,
    ROTORS,
    STATE,
    stage_functions,
    stage_state_size,
)
from relform_controller.solver.team_qp import TeamQp
from relform_core.arrays import Array, Integers
from relform_core.controller_config import WeightsConfig


class Linearization:
    """Makes quadratic programs of one problem.

    Args:
        ocp: the problem.
        terms: of its cost.
    """

    def __init__(self, ocp: Ocp, terms: Terms) -> None:
        self._ocp, self._terms = ocp, terms
        self._nz = stage_state_size(ocp)
        self._pairs = np.array(ocp.pairs).reshape(-1, 2)
        functions, n_stages = stage_functions(ocp, terms), ocp.n_stages
        self._vehicle = _evaluator(functions.vehicle, ocp.n_vehicles, n_stages)
        self._leader_hessian = _evaluator(functions.leader_hessian, 1, n_stages)
        self._leader_gradient = _evaluator(functions.leader_gradient, 1, n_stages)
        self._pair_hessian = _evaluator(functions.pair_hessian, len(ocp.pairs), n_stages)
        self._pair_gradient = _evaluator(functions.pair_gradient, len(ocp.pairs), n_stages)
        self._vehicle_rows = _rows_evaluator(functions.vehicle_rows, ocp.n_vehicles, n_stages, layout.N_STATE)
        self._pair_rows = _rows_evaluator(functions.pair_rows, len(ocp.pairs), n_stages, 2 * layout.N_STATE)
        self._rows_of_pairs = rows_of_pairs(ocp)
        self._prices = row_prices(ocp).T
        self.set_weights(ocp.weights)

    def set_weights(self, weights: WeightsConfig) -> None:
        """Change the weights of the terms."""
        self._weights = term_weights(self._ocp, self._terms, weights)

    def prepare(self, guess: Plan, geometry: TeamGeometry) -> TeamQp:
        """All but the gradients of the terms of leader and pairs and the soft constraints, which wait for the
        measurement (``gradient`` and ``rows``)."""
        ocp, nz, nu, N = self._ocp, self._nz, layout.N_INPUT, self._ocp.n_stages
        lag, z = guess.rotors.lag, stage_states(ocp, guess)
        following, by_state, by_mean_thrusts, cost, gradient, hessian = self._vehicle(
            guess.states[:, :-1],
            z[:, :-1, BEFORE],
            z[:, :-1, ROTORS] if ocp.rotors_may_lag else guess.thrusts,
            guess.thrusts,
            disturbances(ocp, geometry)[:, None],
            np.full((1, 1, 1), lag.memory(ocp.stage)),
            self._weights.vehicle,
        )
        hessian = _symmetric(hessian)
        n_z, n_u = ocp.n_vehicles * nz, ocp.n_vehicles * nu
        A, B = np.zeros((N, n_z, n_z)), np.zeros((N, n_z, n_u))
        Q, S, R = np.zeros((N + 1, n_z, n_z)), np.zeros((N, n_u, n_z)), np.zeros((N, n_u, n_u))
        gap, q, r = np.zeros((N, n_z)), np.zeros((N + 1, n_z)), np.zeros((N, n_u))
        m, e = lag.memory(ocp.stage), lag.decay(ocp.stage)
        for i in range(ocp.n_vehicles):
            of_z, of_u = slice(i * nz, (i + 1) * nz), slice(i * nu, (i + 1) * nu)
            A_i, B_i = A[:, of_z, of_z], B[:, of_z, of_u]
            A_i[:, STATE, STATE] = by_state[i]
            B_i[:, STATE] = (1.0 - m) * by_mean_thrusts[i]
            B_i[:, BEFORE] = np.eye(nu)
            if ocp.rotors_may_lag:
                A_i[:, STATE, ROTORS] = m * by_mean_thrusts[i]
                A_i[:, ROTORS, ROTORS] = e * np.eye(nu)
                B_i[:, ROTORS] = (1.0 - e) * np.eye(nu)
            gap[:, of_z][:, STATE] = following[i] - guess.states[i, 1:]
            Q[:-1, of_z, of_z] = hessian[i, :, :nz, :nz]
            S[:, of_u, of_z] = hessian[i, :, nz:, :nz]
            R[:, of_u, of_u] = hessian[i, :, nz:, nz:]
            q[:-1, of_z], r[:, of_u] = gradient[i, :, :nz], gradient[i, :, nz:]
        self._add_leader_and_pairs(Q, guess, geometry)
        lower, upper = (
            (bound - guess.thrusts).swapaxes(0, 1).reshape(N, n_u)
            for bound in (ocp.thrust_min, ocp.thrust_max)
        )
        n_rows = self._prices.shape[1]
        C, c = np.zeros((N, n_rows, n_z)), np.zeros((N, n_rows))
        return TeamQp(A, B, gap, Q, S, R, q, r, lower, upper, float(cost.sum()), C, c, *self._prices)

    def gradient(
        self, guess: Plan, geometry: TeamGeometry, reference: HorizonReference
    ) -> tuple[Array, float]:
        """Gradient by z [stage, nz] and cost of the terms of leader and pairs, in the measured geometry."""
        q, states = np.zeros((self._ocp.n_stages + 1, self._ocp.n_vehicles * self._nz)), guess.states[:, 1:]
        leader = np.concatenate([reference.p_NB_N, reference.yaw_NB[:, None]], axis=1)[None, 1:]
        cost, gradient = self._leader_gradient(
            states[:1], leader_frame(geometry), leader, self._weights.leader
        )
        q[1:, STATE] += gradient[0]
        pair_cost, pair_gradient = self._pair_gradient(
            *(states[vehicles] for vehicles in self._pairs.T),
            pair_frames(geometry)[:, None],
            reference.p_B1B2_C1[:, 1:],
            self._weights.pair,
        )
        for pair, states_of_pair in enumerate(self._states_of_pairs()):
            q[1:, states_of_pair] += pair_gradient[pair]
        return q, float(cost.sum() + pair_cost.sum())

    def rows(self, guess: Plan, geometry: TeamGeometry) -> tuple[Array, Array]:
        """C and c of the soft constraints: first the rows of every vehicle, then those of the pairs."""
        ocp, states = self._ocp, guess.states[:, 1:]
        h_vehicle, by_state = self._vehicle_rows(states, vehicle_frames(ocp, geometry)[:, None])
        h_pair, by_states = self._pair_rows(
            *(states[vehicles] for vehicles in self._pairs.T), pair_frames(geometry)[:, None]
        )
        n_own, n_rows = h_vehicle.shape[2], self._prices.shape[1]
        C, c = np.zeros((ocp.n_stages, n_rows, ocp.n_vehicles * self._nz)), np.zeros((ocp.n_stages, n_rows))
        for i in range(ocp.n_vehicles):
            rows, states_of_i = slice(i * n_own, (i + 1) * n_own), np.arange(layout.N_STATE) + i * self._nz
            C[:, rows, states_of_i], c[:, rows] = by_state[i], h_vehicle[i]
        states_of_pairs = self._states_of_pairs()
        for number, (pair, row) in enumerate(self._rows_of_pairs, start=ocp.n_vehicles * n_own):
            C[:, number, states_of_pairs[pair]], c[:, number] = by_states[pair, :, row], h_pair[pair, :, row]
        return C, c

    def start_deviation(self, guess: Plan, start: HorizonStart) -> Array:
        """dz_0, shape (nz,)."""
        parts = [start.states, start.applied_thrusts, start.rotors.thrusts]
        measured = np.concatenate(parts[: 3 if self._ocp.rotors_may_lag else 2], axis=1)
        deviation: Array = (measured - stage_states(self._ocp, guess)[:, 0]).reshape(-1)
        return deviation

    def _add_leader_and_pairs(self, Q: Array, guess: Plan, geometry: TeamGeometry) -> None:
        """Add their Hessians, which do not depend on the reference."""
        states, no_reference = guess.states[:, 1:], np.zeros(4)
        (hessian,) = self._leader_hessian(
            states[:1], leader_frame(geometry), no_reference, self._weights.leader
        )
        Q[1:, STATE, STATE] += _symmetric(hessian)[0]
        (hessians,) = self._pair_hessian(
            *(states[vehicles] for vehicles in self._pairs.T),
            pair_frames(geometry)[:, None],
            no_reference[:3],
            self._weights.pair,
        )
        hessians = _symmetric(hessians)
        for pair, states_of_pair in enumerate(self._states_of_pairs()):
            Q[1:, states_of_pair[:, None], states_of_pair] += hessians[pair]

    def _states_of_pairs(self) -> Integers:
        """Places of the states of observer and target in z, shape (pair, 2 * N_STATE)."""
        places: Integers = (self._pairs[:, :, None] * self._nz + np.arange(layout.N_STATE)).reshape(
            -1, 2 * layout.N_STATE
        )
        return places


def stage_states(ocp: Ocp, plan: Plan) -> Array:
    """The stage states of a plan, shape (vehicle, stage 0..N, z of one vehicle).

    Which commands came before the plan is not part of it; the first ones stand in for them.
    """
    before = np.concatenate([plan.thrusts[:, :1], plan.thrusts], axis=1)
    if not ocp.rotors_may_lag:
        return np.concatenate([plan.states, before], axis=2)
    return np.concatenate([plan.states, before, plan.rotor_thrusts(ocp.stage)], axis=2)


@dataclass(frozen=True, eq=False)
class TermWeights:
    """The weights of the terms of a cost, with the terminal scale."""

    vehicle: Array
    """Of every vehicle and stage, shape (term,)."""
    leader: Array
    """Shape (stage 1..N, term)."""
    pair: Array
    """Shape (pair, stage 1..N, term)."""


def term_weights(ocp: Ocp, terms: Terms, weights: WeightsConfig) -> TermWeights:
    """The weights that a configuration gives to the terms."""
    vehicle = np.array([term.weight(ocp, weights) for term in terms.vehicle])
    leader = np.array([term.weight(ocp, weights) for term in terms.leader])
    pairs = np.array([[term.weight(ocp, weights, i, j) for term in terms.pair] for i, j in ocp.pairs])
    scale = np.ones((ocp.n_stages, 1))
    scale[-1] = weights.terminal_scale
    return TermWeights(vehicle, scale * leader, scale * pairs[:, None])


def disturbances(ocp: Ocp, geometry: TeamGeometry) -> Array:
    """As the functions take them, shape (vehicle, 4)."""
    if geometry.disturbances is None:
        return np.tile([0.0, 0.0, 0.0, 1.0], (ocp.n_vehicles, 1))
    return geometry.disturbances.inputs


def leader_frame(geometry: TeamGeometry) -> Array:
    """p_NI_N and yaw_NI of the leader, shape (4,)."""
    return np.append(geometry.p_NI_N, geometry.yaw_NI)


def rows_of_pairs(ocp: Ocp) -> list[tuple[int, int]]:
    """(pair, constraint of pairs) of every soft constraint that there is, by number."""
    return [
        (pair, row)
        for pair, of in enumerate(ocp.pairs)
        for row, constraint in enumerate(ocp.constraints.pair)
        if of in constraint.pairs
    ]


def row_prices(ocp: Ocp) -> Array:
    """Price and square price of every soft constraint of a stage, shape (row, 2)."""
    prices = [constraint.prices for constraint in ocp.constraints.vehicle] * ocp.n_vehicles
    prices += [ocp.constraints.pair[row].prices for _, row in rows_of_pairs(ocp)]
    return np.array([(each.price, each.square_price) for each in prices]).reshape(-1, 2)


def vehicle_frames(ocp: Ocp, geometry: TeamGeometry) -> Array:
    """p_NI_N and yaw_NI of every vehicle, as the leader sees them, shape (vehicle, 4)."""
    frames = np.empty((ocp.n_vehicles, 4))
    frames[0] = leader_frame(geometry)
    from_leader = slice(0, ocp.n_vehicles - 1)  # the first pairs are (leader, each follower)
    frames[1:, :3] = frames[0, :3] + geometry.p_I1I2_I1[from_leader] @ rotation_z(geometry.yaw_NI).T
    frames[1:, 3] = frames[0, 3] + geometry.yaw_I1I2[from_leader]
    return frames


def pair_frames(geometry: TeamGeometry) -> Array:
    """p_I1I2_I1 and yaw_I1I2 of every pair, shape (pair, 4)."""
    return np.concatenate([geometry.p_I1I2_I1, geometry.yaw_I1I2[:, None]], axis=1)


def _rows_evaluator(
    function: ca.Function | None, n_items: int, n_stages: int, n_states: int
) -> Callable[..., tuple[Array, ...]]:
    """Values and derivatives of soft constraints, shapes (item, stage, row) and (item, stage, row, state)."""
    if function is None:
        return lambda *_: (np.zeros((n_items, n_stages, 0)), np.zeros((n_items, n_stages, 0, n_states)))
    return _evaluator(function, n_items, n_stages)


def _symmetric(upper: Array) -> Array:
    symmetric: Array = upper + np.triu(upper, 1).swapaxes(-1, -2)
    return symmetric


def _evaluator(function: ca.Function, n_items: int, n_stages: int) -> Callable[..., tuple[Array, ...]]:
    """The function for all items and stages; inputs broadcast to (item, stage, size)."""
    evaluate = Kernel.interpreted(function, n_items * n_stages)
    sizes = [function.size1_in(i) for i in range(function.n_in())]

    def evaluate_all(*inputs: Array) -> tuple[Array, ...]:
        full = [np.broadcast_to(x, (n_items, n_stages, n)) for x, n in zip(inputs, sizes, strict=True)]
        return tuple(out.reshape(n_items, n_stages, *out.shape[1:]).copy() for out in evaluate(*full))

    return evaluate_all
