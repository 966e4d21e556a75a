"""Every term of the cost against differences of its own residual; a term from outside enters the solver."""

import dataclasses
from typing import Any

import numpy as np
import pytest

from relform_controller.ocp import layout
from relform_controller.ocp.problem import Ocp, Plan
from relform_controller.ocp.terms.registry import TERMS, make_terms
from relform_controller.ocp.terms.term import ByInputs, ByStates, Derivatives, Expansion, Instance, Term
from relform_controller.solver.dense.rti import RealTimeIteration, expand
from relform_controller.solver.kernels import Kernels
from relform_controller.solver.warm_start import hover_plan
from relform_core.controller_config import WeightsConfig
from support.problems import Problem, random_problem, random_thrusts_of_team
from support.world import Array

STEP = 1e-6
PROBLEM = random_problem(3, 3, "controller.horizon_steps=4")


class Separation:
    """A term from outside: the squared distance of each pair of neighbours in team order, in one {mi}."""

    name = "separation"
    n_rows = 1
    at_end = True
    is_own = False
    is_constant = False
    functions = ()

    def __init__(self, ocp: Ocp) -> None:
        self.n_items = ocp.n_vehicles - 1
        self._first, self._second = np.arange(self.n_items), np.arange(1, ocp.n_vehicles)

    def weights(self, weights: WeightsConfig) -> Array:
        return np.full((1, 1, 1), 0.7)

    def derivatives(self, expansion: Expansion) -> Derivatives:
        gap = 2.0 * self._gap(expansion.guess.states)[:, 1:, None]
        return (
            ByStates(self._first, layout.POSITION, -gap),
            ByStates(self._second, layout.POSITION, gap),
        )

    def residual(self, expansion: Expansion, instance: Instance) -> Array:
        states = expansion.guess.states
        gap, deviation = self._gap(states), self._gap(instance.state_deviation)
        return np.sum(gap**2 + 2.0 * gap * deviation, axis=-1, keepdims=True)[:, 1:]

    def _gap(self, states: Array) -> Array:
        positions = states[..., layout.POSITION]
        return positions[self._second] - positions[self._first]


class Climb:
    """Another one: the vertical speed of each vehicle."""

    name = "climb"
    n_rows = 1
    at_end = True
    is_own = True
    is_constant = False
    functions = ()

    def __init__(self, ocp: Ocp) -> None:
        self.n_items, self._n_stages = ocp.n_vehicles, ocp.n_stages

    def weights(self, weights: WeightsConfig) -> Array:
        return np.full((1, 1, 1), 1e4)

    def derivatives(self, expansion: Expansion) -> Derivatives:
        return (ByStates(np.arange(self.n_items), [5], np.ones((self.n_items, self._n_stages, 1, 1))),)

    def residual(self, expansion: Expansion, instance: Instance) -> Array:
        return (expansion.guess.states + instance.state_deviation)[:, 1:, 5:6]


def guess_of(problem: Problem) -> Plan:
    """A guess with gaps between its stages."""
    thrusts = random_thrusts_of_team(7, problem.ocp, problem.config.vehicle.hover_thrust)
    states = np.random.default_rng(7).uniform(-0.4, 0.4, (*thrusts.shape[:2], layout.N_STATE))
    states = np.concatenate([states, states[:, :1] + 0.1], axis=1)
    return Plan(states, thrusts, problem.rotors)


class Evaluated:
    """One term of a problem, at any guess."""

    def __init__(self, problem: Problem, term: Any) -> None:
        self.problem = problem
        self.term: Term = term(problem.ocp)
        self._kernels = Kernels(problem.ocp, [self.term])

    def expansion(self, guess: Plan) -> Expansion:
        return expand(self.problem.ocp, self._kernels, guess, self.problem.poses.geometry())[0]

    def residual(self, guess: Plan, state_deviation: Array | None = None) -> Array:
        deviation = np.zeros_like(guess.states) if state_deviation is None else state_deviation
        problem = self.problem
        instance = Instance(deviation, problem.poses.geometry(), problem.reference, problem.applied_thrusts)
        found = self.term.residual(self.expansion(guess), instance)
        assert found.shape == (self.term.n_items, problem.ocp.n_stages, self.term.n_rows)
        return found.copy()

    def slopes(self, guess: Plan) -> tuple[Array, Array]:
        """Derivatives by all states and by all inputs, whose axes come last."""

        def by(name: str) -> Array:
            value = getattr(guess, name)
            found = np.zeros((*self.residual(guess).shape, *value.shape))
            for place in np.ndindex(value.shape):
                delta = np.zeros_like(value)
                delta[place] = STEP
                ahead, behind = (
                    self.residual(dataclasses.replace(guess, **{name: value + sign * delta}))
                    for sign in (1, -1)
                )
                found[(..., *place)] = (ahead - behind) / (2 * STEP)
            return found

        return by("states"), by("thrusts")


@pytest.mark.parametrize("term", [*TERMS, Separation, Climb])
def test_derivatives_are_those_of_the_residual_and_no_other_is_left_out(term: Any) -> None:
    evaluated, guess = Evaluated(PROBLEM, term), guess_of(PROBLEM)
    by_states, by_inputs = evaluated.slopes(guess)
    for block in evaluated.term.derivatives(evaluated.expansion(guess)):
        for item, vehicle in enumerate(block.vehicles):
            for stage in range(PROBLEM.ocp.n_stages):
                if isinstance(block, ByStates):
                    at = stage + 1 if evaluated.term.at_end else stage
                    columns = np.arange(layout.N_STATE)[block.components]
                    by_states[item, stage, :, vehicle, at, columns] -= block.values[item, stage].T
                elif stage >= (lag := block.lag if isinstance(block, ByInputs) else 0):
                    by_inputs[item, stage, :, vehicle, stage - lag] -= block.values[item, stage]
    np.testing.assert_allclose(by_states, 0.0, atol=1e-7)
    np.testing.assert_allclose(by_inputs, 0.0, atol=1e-7)


@pytest.mark.parametrize("term", [*TERMS, Separation, Climb])
def test_residuals_are_right_to_first_order_in_the_deviation_of_the_states(term: Any) -> None:
    evaluated, guess = Evaluated(PROBLEM, term), guess_of(PROBLEM)
    direction = np.random.default_rng(5).uniform(-1.0, 1.0, guess.states.shape)
    change = evaluated.residual(guess, direction) - evaluated.residual(guess)
    ahead, behind = (
        evaluated.residual(dataclasses.replace(guess, states=guess.states + sign * STEP * direction))
        for sign in (1, -1)
    )
    np.testing.assert_allclose(change, (ahead - behind) / (2 * STEP), atol=1e-6)


@pytest.mark.parametrize("term", [*TERMS, Separation, Climb])
def test_an_own_term_depends_on_its_vehicle_alone_and_a_constant_one_on_inputs_alone(term: Any) -> None:
    evaluated, guess = Evaluated(PROBLEM, term), guess_of(PROBLEM)
    by_states, by_inputs = evaluated.slopes(guess)
    if evaluated.term.is_own:
        for item in range(evaluated.term.n_items):
            others = np.arange(PROBLEM.ocp.n_vehicles) != item
            assert not by_states[item, :, :, others].any()
            assert not by_inputs[item, :, :, others].any()
    if evaluated.term.is_constant:
        assert not by_states.any()


def test_every_term_has_a_weight_of_its_own_in_the_configuration() -> None:
    names = [term.name for term in make_terms(PROBLEM.ocp)]
    assert len(set(names)) == len(names)
    assert {*names, "terminal_scale"} == set(WeightsConfig.model_fields)
    for name in names:
        weights = PROBLEM.config.controller.weights
        doubled = weights.model_copy(update={name: 2.0 * getattr(weights, name)})
        for term in make_terms(PROBLEM.ocp):
            factor = 2.0 if term.name == name else 1.0
            np.testing.assert_allclose(term.weights(doubled), factor * term.weights(weights))


def test_terms_from_outside_act_in_the_solver() -> None:
    """A high price of climbing keeps the vehicles at their height; without a weight it changes nothing."""
    guess = hover_plan(PROBLEM.start, PROBLEM.config.vehicle.hover_thrust, PROBLEM.ocp.n_stages)

    def solved(*terms: Term) -> Plan:
        solver = RealTimeIteration(PROBLEM.ocp, terms, Kernels(PROBLEM.ocp, terms))
        plan = guess
        for _ in range(10):
            solver.prepare(plan, PROBLEM.poses.geometry())
            plan = solver.feedback(PROBLEM.start, PROBLEM.poses.geometry(), PROBLEM.reference).plan
        return plan

    paper = make_terms(PROBLEM.ocp)
    plain, level = solved(*paper), solved(Separation(PROBLEM.ocp), Climb(PROBLEM.ocp), *paper)
    climb = [np.abs(plan.states[:, -1, 5]).max() for plan in (plain, level)]
    assert climb[1] < 0.2 * climb[0]
