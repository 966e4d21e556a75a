"""Prepare and feedback of both solvers: state and errors. Oracle tests check that they are right."""

import dataclasses

import numpy as np
import pytest

from relform_controller.ocp import layout
from relform_controller.solver.solver import QpError, Solver, SqpStep
from relform_controller.solver.warm_start import hover_plan
from support.problems import SOLVERS, Problem, random_problem, simulate, solver_of

PROBLEM = random_problem(2, 3, "controller.horizon_steps=6")
GUESS = hover_plan(PROBLEM.start, PROBLEM.config.vehicle.hover_thrust, 6)


@pytest.fixture(params=SOLVERS)
def rti(request: pytest.FixtureRequest) -> Solver:
    return solver_of(PROBLEM.ocp, request.param)


def feedback(rti: Solver, problem: Problem = PROBLEM) -> SqpStep:
    return rti.feedback(problem.start, problem.poses.geometry(), problem.reference)


def assert_same(found: SqpStep, expected: SqpStep) -> None:
    np.testing.assert_array_equal(found.plan.thrusts, expected.plan.thrusts)
    np.testing.assert_array_equal(found.plan.states, expected.plan.states)
    assert (found.kkt, found.objective, found.qp_iterations) == (
        expected.kkt,
        expected.objective,
        expected.qp_iterations,
    )


def test_inputs_stay_within_their_bounds_and_some_lie_on_them(rti: Solver) -> None:
    rti.prepare(GUESS, PROBLEM.poses.geometry())
    step = feedback(rti)
    ocp, thrusts = PROBLEM.ocp, step.plan.thrusts
    assert thrusts.min() >= ocp.thrust_min
    assert thrusts.max() <= ocp.thrust_max
    on_bounds = [np.isclose(thrusts, bound, atol=1e-9).sum() for bound in (ocp.thrust_min, ocp.thrust_max)]
    assert sum(on_bounds) == step.active_bounds > 0


def test_iterating_closes_the_gaps_between_the_stages(rti: Solver) -> None:
    """The guess violates the dynamics; the plan obeys them in the end."""
    plan, gaps = GUESS, []
    for _ in range(30):
        rti.prepare(plan, PROBLEM.poses.geometry())
        plan = feedback(rti).plan
        following = [
            simulate(PROBLEM.ocp, plan.states[:, k], plan.thrusts[:, k : k + 1])[:, 1] for k in range(6)
        ]
        gaps.append(np.abs(np.stack(following, axis=1) - plan.states[:, 1:]).max())
    assert gaps[0] > 0.01
    assert gaps[-1] < 1e-8


def test_a_feedback_leaves_no_trace_in_the_next(rti: Solver) -> None:
    rti.prepare(GUESS, PROBLEM.poses.geometry())
    first = feedback(rti)
    feedback(rti, dataclasses.replace(PROBLEM, initial_states=0.5 * PROBLEM.initial_states))
    assert_same(feedback(rti), first)


def test_a_preparation_leaves_no_trace_in_the_next(rti: Solver) -> None:
    rti.prepare(GUESS, PROBLEM.poses.geometry())
    expected = feedback(rti)
    rti.prepare(expected.plan, random_problem(3, 3, "controller.horizon_steps=6").poses.geometry())
    feedback(rti)
    rti.prepare(GUESS, PROBLEM.poses.geometry())
    assert_same(feedback(rti), expected)


def test_feedback_needs_a_preparation(rti: Solver) -> None:
    with pytest.raises(RuntimeError, match="needs a prepare"):
        feedback(rti)


def test_a_guess_that_is_not_finite_cannot_be_prepared_nor_used(rti: Solver) -> None:
    rti.prepare(GUESS, PROBLEM.poses.geometry())
    states = GUESS.states.copy()
    states[1, 3, layout.PITCH] = np.nan
    with pytest.raises(QpError, match="the Hessian is not finite or not positive definite"):
        rti.prepare(dataclasses.replace(GUESS, states=states), PROBLEM.poses.geometry())
    with pytest.raises(RuntimeError, match="needs a prepare"):
        feedback(rti)


def test_a_measurement_that_is_not_finite_is_refused_and_the_next_one_is_not(rti: Solver) -> None:
    rti.prepare(GUESS, PROBLEM.poses.geometry())
    expected = feedback(rti)
    states = PROBLEM.initial_states.copy()
    states[2, layout.VELOCITY] = np.inf
    with pytest.raises(QpError, match="the gradient is not finite"):
        feedback(rti, dataclasses.replace(PROBLEM, initial_states=states))
    assert_same(feedback(rti), expected)
