"""The functions of one stage against differences: dynamics, gradients, and Gauss-Newton Hessians."""

import dataclasses
from collections.abc import Callable

import casadi as ca
import numpy as np
import pytest

from relform_controller.ocp import layout
from relform_controller.ocp.problem import Ocp
from relform_controller.ocp.terms.registry import TERMS
from relform_controller.ocp.terms.term import (
    LeaderStage,
    LeaderTerm,
    PairStage,
    PairTerm,
    Terms,
    VehicleStage,
    VehicleTerm,
)
from relform_controller.solver.solver import Solver
from relform_controller.solver.stages import StageFunctions, stage_functions
from relform_controller.solver.warm_start import hover_plan
from relform_core.controller_config import WeightsConfig
from support.problems import SOLVERS, random_problem, simulate
from support.scenarios import paper_scenario
from support.world import Array

STEP = 1e-6
VEHICLES = {
    "hummingbird": (),
    "drag": ("vehicle.drag_coefficient_n_s_m=[0.3, 0.2, 0.1]",),
    "lag": ("vehicle.rotor_time_constant_s=0.04",),
}
CLIMB = VehicleTerm("climb", lambda _, stage: stage.state[5], lambda *_: 1e4)
HEIGHT = LeaderTerm("height", lambda stage: stage.p_NI_N[2] + ca.sin(stage.state[2]), lambda *_: 3.0)
CLOSING = PairTerm(
    "closing",
    lambda stage: ca.sumsqr(stage.observer[layout.VELOCITY]) * stage.target[layout.ROLL],
    lambda _, __, observer, target: 0.5 + observer + target,
)
"""Terms from outside."""
MORE_TERMS = Terms((*TERMS.vehicle, CLIMB), (*TERMS.leader, HEIGHT), (*TERMS.pair, CLOSING))


def problem_of(vehicle: str) -> tuple[Ocp, StageFunctions]:
    ocp = Ocp.from_config(paper_scenario(*VEHICLES[vehicle]).config)
    return ocp, stage_functions(ocp, MORE_TERMS)


def random_arguments(function: ca.Function, seed: int) -> list[Array]:
    generator = np.random.default_rng(seed)
    arguments = [generator.uniform(-0.6, 0.6, function.size1_in(i)) for i in range(function.n_in())]
    arguments[-1] = generator.uniform(0.1, 2.0, arguments[-1].size)  # weights
    return arguments


def slopes(of: Callable[[Array], Array], at: Array) -> Array:
    """Shape (value, argument)."""
    return np.array([(of(at + d) - of(at - d)) / (2 * STEP) for d in np.eye(at.size) * STEP]).T


def symmetric(upper: Array) -> Array:
    return upper + np.triu(upper, 1).T


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("vehicle", VEHICLES)
def test_dynamics_of_a_vehicle(vehicle: str, seed: int) -> None:
    ocp, functions = problem_of(vehicle)
    state, before, rotors, commands, disturbance, _, weights = random_arguments(functions.vehicle, seed)
    commands, memory = commands + 1.7, 0.3 if ocp.rotors_may_lag else 0.0
    calm = np.array([0.0, 0.0, 0.0, 1.0])

    def outputs(state: Array, rotors: Array, commands: Array, disturbance: Array) -> list[Array]:
        arguments = (state, before, rotors, commands, disturbance, memory, weights)
        return [np.array(output) for output in functions.vehicle(*arguments)]

    def following(state: Array, thrusts: Array) -> Array:
        return outputs(state, thrusts, thrusts, calm)[0][:, 0]

    found, by_state, by_mean_thrusts, *_ = outputs(state, rotors + 1.7, commands, calm)
    mean = (1.0 - memory) * commands + memory * (rotors + 1.7)
    one = dataclasses.replace(ocp, n_vehicles=1)
    np.testing.assert_allclose(
        found[:, 0], simulate(one, state[None], mean[None, None])[0, 1], rtol=1e-12, atol=1e-12
    )
    np.testing.assert_allclose(by_state, slopes(lambda x: following(x, mean), state), atol=1e-7)
    np.testing.assert_allclose(by_mean_thrusts, slopes(lambda f: following(state, f), mean), atol=1e-7)
    # Thrust as it truly is, and a force whose acceleration lasts for one stage.
    disturbance[3] += 1.0
    pushed = outputs(state, rotors, commands, disturbance)[0][:, 0]
    mean = (1.0 - memory) * commands + memory * rotors
    expected = following(state, disturbance[3] * mean)
    pushed_velocity = expected[layout.VELOCITY] + disturbance[:3] * ocp.stage
    if not any(ocp.body.drag):
        np.testing.assert_allclose(pushed[layout.VELOCITY], pushed_velocity, atol=1e-12)
        np.testing.assert_allclose(pushed[6:], expected[6:], atol=1e-12)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("vehicle", VEHICLES)
def test_cost_of_a_vehicle(vehicle: str, seed: int) -> None:
    ocp, functions = problem_of(vehicle)
    state, before, rotors, commands, disturbance, memory, weights = random_arguments(functions.vehicle, seed)
    n = layout.N_STATE
    extra = [before, rotors] if ocp.rotors_may_lag else [before]
    stage = np.concatenate([state, *extra, commands])

    def arguments(stage: Array) -> tuple[Array, ...]:
        last = stage[n + 4 : n + 8] if ocp.rotors_may_lag else rotors
        return stage[:n], stage[n : n + 4], last, stage[-4:], disturbance, memory, weights

    def residual(stage: Array) -> Array:
        """Of the terms, with the acceleration from a difference of a short simulation."""
        x, before, last, u, _, _, _ = arguments(stage)
        mean = (1.0 - memory) * u + memory * last if ocp.rotors_may_lag else u
        short = dataclasses.replace(ocp, stage=1e-5, n_vehicles=1)
        moved = simulate(short, x[None], disturbance[3] * mean[None, None])[0, 1]
        acceleration = (moved - x)[layout.VELOCITY] / 1e-5 + disturbance[:3]
        found = []
        for term, weight in zip(MORE_TERMS.vehicle, weights, strict=True):
            symbols = VehicleStage(ca.SX(x), ca.SX(u), ca.SX(before), ca.SX(acceleration))
            found.append(np.sqrt(weight) * np.array(ca.DM(term.residual(ocp, symbols))).reshape(-1))
        return np.concatenate(found)

    _, _, _, cost, gradient, hessian = (np.array(out) for out in functions.vehicle(*arguments(stage)))
    J, r = slopes(residual, stage), residual(stage)
    assert cost.item() == pytest.approx(r @ r, rel=1e-4)
    np.testing.assert_allclose(gradient[:, 0], 2.0 * J.T @ r, rtol=2e-3, atol=2e-3 * np.abs(gradient).max())
    np.testing.assert_allclose(symmetric(hessian), 2.0 * J.T @ J, atol=2e-4 * np.abs(hessian).max())

    def cost_at(stage: Array) -> Array:
        return np.array(functions.vehicle(*arguments(stage))[3]).reshape(-1)

    np.testing.assert_allclose(gradient.T, slopes(cost_at, stage), rtol=1e-6, atol=1e-5)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("of", ["leader", "pair"])
def test_cost_of_leader_and_pairs(of: str, seed: int) -> None:
    _, functions = problem_of("hummingbird")
    gradient_of, hessian_of = (getattr(functions, f"{of}_{what}") for what in ("gradient", "hessian"))
    arguments = random_arguments(gradient_of, seed)
    n_states = 1 if of == "leader" else 2
    states, rest = np.concatenate(arguments[:n_states]), arguments[n_states:]
    frame, reference, weights = rest

    def residual(states: Array) -> Array:
        own = states.reshape(n_states, -1)
        found = []
        terms = MORE_TERMS.leader if of == "leader" else MORE_TERMS.pair
        for term, weight in zip(terms, weights, strict=True):
            symbols = [ca.SX(x) for x in (*own, frame[:3], frame[3], reference[:3], *reference[3:])]
            stage = LeaderStage(*symbols) if of == "leader" else PairStage(*symbols)
            found.append(np.sqrt(weight) * np.array(ca.DM(term.residual(stage))).reshape(-1))  # type: ignore[arg-type]
        return np.concatenate(found)

    cost, gradient = (np.array(out) for out in gradient_of(*arguments))
    (hessian,) = (np.array(out) for out in [hessian_of(*arguments)])
    J, r = slopes(residual, states), residual(states)
    assert cost.item() == pytest.approx(r @ r, rel=1e-12)
    np.testing.assert_allclose(gradient[:, 0], 2.0 * J.T @ r, rtol=1e-6, atol=1e-8)
    np.testing.assert_allclose(symmetric(hessian), 2.0 * J.T @ J, atol=1e-7)


def test_every_term_has_a_weight_of_its_own_in_the_configuration() -> None:
    ocp = Ocp.from_config(paper_scenario().config)
    terms = (*TERMS.vehicle, *TERMS.leader, *TERMS.pair)
    assert {*(term.name for term in terms), "terminal_scale"} == set(WeightsConfig.model_fields)
    for name in (term.name for term in terms):
        doubled = ocp.weights.model_copy(update={name: 2.0 * getattr(ocp.weights, name)})
        for term in terms:
            of = (1, 0) if isinstance(term, PairTerm) else ()
            factor = 2.0 if term.name == name else 1.0
            assert term.weight(ocp, doubled, *of) == factor * term.weight(ocp, ocp.weights, *of)


@pytest.mark.parametrize("kind", SOLVERS)
def test_terms_from_outside_act_in_the_solver(kind: Callable[[Ocp, Terms], Solver]) -> None:
    """A high price of climbing keeps the vehicles at their height."""
    problem = random_problem(3, 3, "controller.horizon_steps=4")
    plans = []
    for terms in (TERMS, MORE_TERMS):
        solver = kind(problem.ocp, terms)
        plan = hover_plan(problem.start, problem.config.vehicle.hover_thrust, problem.ocp.n_stages)
        for _ in range(10):
            solver.prepare(plan, problem.poses.geometry())
            plan = solver.feedback(problem.start, problem.poses.geometry(), problem.reference).plan
        plans.append(plan)
    climb = [np.abs(plan.states[:, -2, 5]).max() for plan in plans]
    assert climb[1] < 0.2 * climb[0]
