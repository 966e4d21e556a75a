"""Derivatives of the model and of all residuals against differences of a simulation in the world frame."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pytest

from relform_controller.ocp import layout
from relform_controller.ocp.problem import Plan
from relform_controller.ocp.terms.registry import make_terms
from relform_controller.ocp.terms.term import Expansion, Instance, Term
from relform_controller.solver.dense.condensing import StateMaps
from relform_controller.solver.dense.cost import CondensedCost
from relform_controller.solver.dense.rti import expand
from relform_controller.solver.kernels import Kernels
from support.problems import (
    Problem,
    kernels_of,
    random_problem,
    random_thrusts_of_team,
    residual,
    simulate,
    simulated_plan,
    weights,
)
from support.world import Array

STEP = 1e-5


@dataclass(frozen=True, eq=False)
class Linearized:
    """The cost around a guess, as the dense solver has it."""

    cost: CondensedCost
    expansion: Expansion
    maps: StateMaps
    jacobian: Array

    def residual(
        self, problem: Problem, state_deviation: Array, mean_thrust_deviation: Array | None = None
    ) -> Array:
        instance = Instance(
            state_deviation,
            problem.poses.geometry(),
            problem.reference,
            problem.applied_thrusts,
            mean_thrust_deviation,
        )
        return self.cost.residual(self.expansion, instance)


def linearize(problem: Problem, guess: Plan, terms: Sequence[Term] | None = None) -> Linearized:
    ocp = problem.ocp
    terms = make_terms(ocp) if terms is None else terms
    cost = CondensedCost(ocp, terms)
    expansion, maps = expand(ocp, Kernels(ocp, terms), guess, problem.poses.geometry())
    return Linearized(cost, expansion, maps, cost.jacobian(expansion, maps))


def feasible_guess(problem: Problem, seed: int) -> Plan:
    thrusts = random_thrusts_of_team(seed, problem.ocp, problem.config.vehicle.hover_thrust)
    return simulated_plan(problem, thrusts)


CASES = [(1, 2), (2, 3), (3, 4)]


@pytest.mark.parametrize(("seed", "n_vehicles"), CASES)
def test_derivatives_of_one_stage(seed: int, n_vehicles: int) -> None:
    drag = "vehicle.drag_coefficient_n_s_m=[0.3, 0.2, 0.1]"
    problem = random_problem(seed, n_vehicles, "controller.horizon_steps=6", drag)
    ocp, guess = problem.ocp, feasible_guess(problem, seed)
    following, A, B, *_ = kernels_of(ocp).vehicle_stage(guess.states[:, :-1], guess.thrusts)
    states, thrusts = (
        guess.states[:, :-1].reshape(-1, layout.N_STATE),
        guess.thrusts.reshape(-1, layout.N_INPUT),
    )

    def next_states(states: Array, thrusts: Array) -> Array:
        pairs = zip(
            states.reshape(n_vehicles, -1, layout.N_STATE).swapaxes(0, 1),
            thrusts.reshape(n_vehicles, -1, layout.N_INPUT).swapaxes(0, 1),
            strict=True,
        )
        stages = [simulate(ocp, x, u[:, None])[:, 1] for x, u in pairs]
        return np.stack(stages, axis=1).reshape(-1, layout.N_STATE)

    np.testing.assert_allclose(following, guess.states[:, 1:].reshape(-1, layout.N_STATE), atol=1e-12)
    for column, delta in enumerate(np.eye(layout.N_STATE) * STEP):
        slope = (next_states(states + delta, thrusts) - next_states(states - delta, thrusts)) / (2 * STEP)
        np.testing.assert_allclose(A[:, :, column], slope, atol=1e-7)
    for column, delta in enumerate(np.eye(layout.N_INPUT) * STEP):
        slope = (next_states(states, thrusts + delta) - next_states(states, thrusts - delta)) / (2 * STEP)
        np.testing.assert_allclose(B[:, :, column], slope, atol=1e-7)


LAG = ("vehicle.rotor_time_constant_s=0.04",)
ANOTHER_VEHICLE = (
    "vehicle.mass_kg=0.5",
    "vehicle.inertia_kg_m2=[0.003, 0.004, 0.006]",
    "vehicle.arm_length_m=0.12",
    "vehicle.torque_coefficient_nm_s2=2.0e-7",
    "vehicle.drag_coefficient_n_s_m=[0.3, 0.2, 0.1]",
)


@pytest.mark.parametrize(
    "vehicle",
    [(), ANOTHER_VEHICLE, LAG, (*LAG, "controller.stage_s=0.08")],
    ids=["hummingbird", "another_vehicle", "lag", "lag_and_long_stages"],
)
@pytest.mark.parametrize(("seed", "n_vehicles"), CASES)
def test_residuals_and_their_gauss_newton_jacobian(
    seed: int, n_vehicles: int, vehicle: tuple[str, ...]
) -> None:
    overrides = ("controller.horizon_steps=6", "controller.weights.thrust_rate_per_n2=0.7", *vehicle)
    problem = random_problem(seed, n_vehicles, *overrides)
    guess = feasible_guess(problem, seed)
    linearized = linearize(problem, guess)
    found = linearized.residual(problem, np.zeros_like(guess.states))
    np.testing.assert_allclose(found, residual(problem, problem.initial_states, guess.thrusts), atol=1e-11)
    np.testing.assert_allclose(linearized.cost.weights, weights(problem))

    flat = guess.thrusts.reshape(-1)

    def at(thrusts: Array) -> Array:
        return residual(problem, problem.initial_states, thrusts.reshape(guess.thrusts.shape))

    slopes = [(at(flat + delta) - at(flat - delta)) / (2 * STEP) for delta in np.eye(flat.size) * STEP]
    np.testing.assert_allclose(linearized.jacobian, np.array(slopes).T, atol=2e-7)


@pytest.mark.parametrize("lag", [(), LAG], ids=["no_lag", "lag"])
@pytest.mark.parametrize(("seed", "n_vehicles"), CASES)
def test_residuals_to_first_order_in_the_start(seed: int, n_vehicles: int, lag: tuple[str, ...]) -> None:
    """What the embedding of a measurement relies on: initial states and thrusts of the rotors."""
    problem = random_problem(seed, n_vehicles, "controller.horizon_steps=6", *lag)
    ocp, guess = problem.ocp, feasible_guess(problem, seed)
    linearized = linearize(problem, guess)
    horizon_lag = problem.rotors.lag.over_horizon(ocp.n_stages, ocp.stage)
    generator = np.random.default_rng(seed)
    for _ in range(10):
        states = generator.uniform(-1.0, 1.0, problem.initial_states.shape)
        rotors = generator.uniform(-1.0, 1.0, problem.rotor_thrusts.shape)
        means = None
        if horizon_lag is not None:
            means = horizon_lag.mean_thrusts(np.zeros_like(guess.thrusts), rotors)
        deviation = linearized.maps.free_response(states, rotors)
        change = linearized.residual(problem, deviation, means) - linearized.residual(
            problem, np.zeros_like(guess.states)
        )
        ahead, behind = (
            residual(
                problem,
                problem.initial_states + sign * STEP * states,
                guess.thrusts,
                problem.rotor_thrusts + sign * STEP * rotors,
            )
            for sign in (1, -1)
        )
        np.testing.assert_allclose(change, (ahead - behind) / (2 * STEP), atol=1e-6)
