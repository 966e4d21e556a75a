"""Algorithm MRTI: how many SQP steps are taken, and what is flown when one fails."""

import itertools
import math
from collections.abc import Callable

import numpy as np
import pytest

from relform_controller.ocp import layout
from relform_controller.ocp.problem import Plan, TeamGeometry
from relform_controller.solver.algorithm import ModifiedRti
from relform_controller.solver.dense.box_qp import QpError
from relform_controller.solver.dense.rti import RealTimeIteration
from relform_controller.solver.kernels import Kernels
from relform_controller.solver.warm_start import hover_plan
from relform_core.names import SolverState
from relform_core.telemetry import SolverReport
from support.problems import random_problem
from support.world import Array

PROBLEM = random_problem(2, 3, "controller.horizon_steps=6")
GEOMETRY = PROBLEM.poses.geometry()
GUESS = hover_plan(PROBLEM.initial_states, PROBLEM.config.vehicle.hover_thrust, 6)


def ticking(tick: float) -> Callable[[], float]:
    """A clock that moves on by ``tick`` whenever it is read."""
    readings = itertools.count()
    return lambda: 100.0 + tick * next(readings)


def make_solver(
    *,
    start: tuple[float, int] = (1e-3, 50),
    flight: tuple[float, int] = (1e-6, 3),
    time_budget: float = math.inf,
    tick: float = 0.001,
) -> ModifiedRti:
    """Tolerance and limit on the number of SQP steps at the start, and in flight."""
    config = PROBLEM.config.controller.solver.model_copy(
        update={
            "kkt_tolerance_start": start[0],
            "sqp_steps_start_max": start[1],
            "kkt_tolerance": flight[0],
            "sqp_steps_max": flight[1],
        }
    )
    return ModifiedRti(PROBLEM.ocp, Kernels(PROBLEM.ocp), config, ticking(tick), time_budget)


def solve(solver: ModifiedRti, states: Array = PROBLEM.initial_states) -> tuple[Plan, SolverReport]:
    return solver.solve(GUESS, states, GEOMETRY, PROBLEM.reference, PROBLEM.applied_thrusts)


def started(solver: ModifiedRti) -> ModifiedRti:
    """The same after its first control step, prepared for the second."""
    solver.prepare(GUESS, GEOMETRY)
    solve(solver)
    solver.prepare(GUESS, GEOMETRY)
    return solver


def steps_by_hand(count: int) -> Plan:
    rti, plan = RealTimeIteration(PROBLEM.ocp, Kernels(PROBLEM.ocp)), GUESS
    for _ in range(count):
        rti.prepare(plan, GEOMETRY)
        plan = rti.feedback(PROBLEM.initial_states, GEOMETRY, PROBLEM.reference, PROBLEM.applied_thrusts).plan
    return plan


def test_at_the_start_it_iterates_to_the_tolerance() -> None:
    solver = make_solver(start=(1e-3, 50))
    solver.prepare(GUESS, GEOMETRY)
    plan, report = solve(solver)
    assert report.state is SolverState.SOLVED
    assert report.kkt < 1e-3 < report.kkt_first
    assert 3 < report.sqp_steps < 50
    assert report.fallback_reason == ""
    np.testing.assert_array_equal(plan.thrusts, steps_by_hand(report.sqp_steps).thrusts)


def test_at_the_start_the_number_of_steps_is_limited() -> None:
    solver = make_solver(start=(1e-12, 4))
    solver.prepare(GUESS, GEOMETRY)
    _, report = solve(solver)
    assert (report.state, report.sqp_steps) == (SolverState.STEP_LIMIT, 4)


@pytest.mark.parametrize("limit", [1, 2, 5])
def test_in_flight_the_number_of_steps_is_limited(limit: int) -> None:
    plan, report = solve(started(make_solver(flight=(1e-12, limit))))
    assert (report.state, report.sqp_steps) == (SolverState.STEP_LIMIT, limit)
    np.testing.assert_array_equal(plan.thrusts, steps_by_hand(limit).thrusts)


def test_in_flight_it_stops_at_its_own_tolerance() -> None:
    _, first = solve(started(make_solver(flight=(1e-12, 1))))
    _, report = solve(started(make_solver(flight=(2.0 * first.kkt, 10))))
    assert (report.state, report.sqp_steps) == (SolverState.SOLVED, 1)
    assert report.kkt == report.kkt_first == first.kkt


def test_the_time_budget_is_for_the_steps_after_the_first() -> None:
    """The clock is read before the first step and after each, and moves on by 0.01 s in between."""
    for budget, steps in ((0.0, 1), (0.0105, 2), (0.0205, 3), (math.inf, 5)):
        solver = started(make_solver(flight=(1e-12, 5), time_budget=budget, tick=0.01))
        plan, report = solve(solver)
        assert (report.state, report.sqp_steps) == (SolverState.STEP_LIMIT, steps)
        np.testing.assert_array_equal(plan.thrusts, steps_by_hand(steps).thrusts)


def test_the_time_budget_does_not_hold_at_the_start() -> None:
    solver = make_solver(start=(1e-3, 50), time_budget=0.0)
    solver.prepare(GUESS, GEOMETRY)
    assert solve(solver)[1].state is SolverState.SOLVED


@pytest.mark.parametrize("count", [1, 4])
def test_a_replay_takes_as_many_steps_as_were_recorded_whatever_the_limits(count: int) -> None:
    solver = started(make_solver(flight=(1e12, 2), time_budget=0.0))
    plan, report = solver.solve(
        GUESS, PROBLEM.initial_states, GEOMETRY, PROBLEM.reference, PROBLEM.applied_thrusts, count
    )
    assert report.sqp_steps == count
    np.testing.assert_array_equal(plan.thrusts, steps_by_hand(count).thrusts)


def test_times_are_reported() -> None:
    solver = make_solver(start=(1e12, 50), tick=0.25)
    solver.prepare(GUESS, GEOMETRY)
    _, report = solve(solver)
    assert report.prepare_time == pytest.approx(0.25)
    assert report.feedback_time > 0.0


def test_iterations_of_all_quadratic_programs_are_counted() -> None:
    _, one = solve(started(make_solver(flight=(1e-12, 1))))
    _, three = solve(started(make_solver(flight=(1e-12, 3))))
    assert one.qp_iterations >= 1
    assert three.qp_iterations >= one.qp_iterations + 2


def not_finite(part: slice) -> Array:
    states = PROBLEM.initial_states.copy()
    states[0, part] = np.nan
    return states


def test_what_cannot_be_solved_flies_the_guess_and_says_why() -> None:
    solver = started(make_solver())
    plan, report = solve(solver, not_finite(layout.VELOCITY))
    assert plan is GUESS
    assert (report.state, report.sqp_steps) == (SolverState.FALLBACK, 0)
    assert report.fallback_reason == "the gradient is not finite"
    assert math.isnan(report.kkt)
    assert math.isnan(report.objective)
    assert report.active_bounds == 0


def test_it_recovers_with_the_next_step() -> None:
    solver = started(make_solver())
    expected, _ = solve(solver)
    solver.prepare(GUESS, GEOMETRY)
    solve(solver, not_finite(layout.RATE))
    solver.prepare(GUESS, GEOMETRY)
    plan, report = solve(solver)
    assert report.state is not SolverState.FALLBACK
    np.testing.assert_array_equal(plan.thrusts, expected.thrusts)


def test_a_failed_preparation_is_told_in_the_step_that_it_was_for() -> None:
    solver = started(make_solver())
    broken = Plan(np.full_like(GUESS.states, np.nan), GUESS.thrusts)
    solver.prepare(broken, GEOMETRY)
    plan, report = solve(solver)
    assert plan is GUESS
    assert (report.state, report.fallback_reason) == (SolverState.FALLBACK, "the Hessian is not finite")
    solver.prepare(GUESS, GEOMETRY)
    assert solve(solver)[1].state is not SolverState.FALLBACK


def test_a_failure_after_a_good_step_flies_what_that_step_found(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    solver = started(make_solver(flight=(1e-12, 3)))
    prepare = RealTimeIteration.prepare

    def fail(rti: RealTimeIteration, guess: Plan, geometry: TeamGeometry) -> None:
        raise QpError("the Hessian is not positive definite")

    expected = steps_by_hand(1)
    monkeypatch.setattr(RealTimeIteration, "prepare", fail)  # the first step is prepared already
    plan, report = solve(solver)
    np.testing.assert_array_equal(plan.thrusts, expected.thrusts)
    assert (report.state, report.sqp_steps) == (SolverState.FALLBACK, 1)
    assert report.fallback_reason == "the Hessian is not positive definite"
    assert math.isfinite(report.kkt)
    monkeypatch.setattr(RealTimeIteration, "prepare", prepare)
    solver.prepare(GUESS, GEOMETRY)
    assert solve(solver)[1].state is SolverState.STEP_LIMIT


def test_a_start_that_failed_is_a_start_again() -> None:
    solver = make_solver(start=(1e-3, 50), flight=(1e-12, 1))
    solver.prepare(GUESS, GEOMETRY)
    assert solve(solver, not_finite(layout.VELOCITY))[1].state is SolverState.FALLBACK
    solver.prepare(GUESS, GEOMETRY)
    assert solve(solver)[1].sqp_steps > 1
