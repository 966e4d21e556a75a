"""Algorithm MRTI: how many SQP steps are taken, what is flown when one fails, and how it recovers."""

import dataclasses
import itertools
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from relform_controller.ocp import layout
from relform_controller.ocp.problem import Plan, TeamGeometry
from relform_controller.solver.algorithm import ModifiedRti
from relform_controller.solver.prediction import predictor
from relform_controller.solver.solver import QpError, Solver, SqpStep
from relform_controller.solver.warm_start import hover_plan, shift, transform
from relform_core.controller_config import WeightsConfig
from relform_core.names import SolverState
from relform_core.telemetry import SolverReport
from support.problems import random_problem, solver_of
from support.world import Array

PROBLEM = random_problem(2, 3, "controller.horizon_steps=6")
GEOMETRY = PROBLEM.poses.geometry()
HOVER_THRUST = PROBLEM.config.vehicle.hover_thrust
HOVER = hover_plan(PROBLEM.start, HOVER_THRUST, 6)


def ticking(tick: float) -> Callable[[], float]:
    """A clock that advances by ``tick`` at each reading."""
    readings = itertools.count()
    return lambda: 100.0 + tick * next(readings)


def make_solver(
    *,
    start: tuple[float, int] = (1e-3, 50),
    flight: tuple[float, int] = (1e-6, 3),
    warm_start: str = "transform",
    time_budget: float = math.inf,
    tick: float = 0.001,
    solver: Solver | None = None,
) -> ModifiedRti:
    """Tolerance and limit on the number of SQP steps at the start, and in flight."""
    config = PROBLEM.config.controller.solver.model_copy(
        update={
            "kkt_tolerance_start": start[0],
            "sqp_steps_start_max": start[1],
            "kkt_tolerance": flight[0],
            "sqp_steps_max": flight[1],
            "warm_start": warm_start,
        }
    )
    solver, predict = solver or solver_of(PROBLEM.ocp), predictor(PROBLEM.ocp)
    return ModifiedRti(PROBLEM.ocp, solver, predict, config, HOVER_THRUST, ticking(tick), time_budget)


def solve(
    solver: ModifiedRti, states: Array = PROBLEM.initial_states, sqp_steps: int | None = None
) -> tuple[Plan, SolverReport]:
    start = dataclasses.replace(PROBLEM.start, states=states)
    return solver.solve(start, GEOMETRY, PROBLEM.reference, sqp_steps)


def started(solver: ModifiedRti) -> ModifiedRti:
    """The same after its first control step, prepared for the second."""
    solve(solver)
    solver.prepare_next()
    return solver


def following(plan: Plan) -> tuple[Plan, TeamGeometry]:
    """The warm start of the next control step, and the geometry predicted for it."""
    shifted = shift(plan, predictor(PROBLEM.ocp), PROBLEM.ocp)
    return transform(shifted, GEOMETRY, PROBLEM.ocp.pairs)


def steps_by_hand(count: int, guess: Plan = HOVER, predicted: TeamGeometry = GEOMETRY) -> Plan:
    """SQP steps for the measurements of ``solve``, the first one prepared in the predicted geometry."""
    rti, plan = solver_of(PROBLEM.ocp), guess
    for step in range(count):
        rti.prepare(plan, predicted if step == 0 else GEOMETRY)
        plan = rti.feedback(PROBLEM.start, GEOMETRY, PROBLEM.reference).plan
    return plan


FIRST, _ = solve(make_solver())
"""The plan of the first control step."""
NEXT, NEXT_GEOMETRY = following(FIRST)


def test_at_the_start_it_iterates_to_the_tolerance() -> None:
    plan, report = solve(make_solver(start=(1e-3, 50)))
    assert report.state is SolverState.SOLVED
    assert report.kkt < 1e-3 < report.kkt_first
    assert 3 < report.sqp_steps < 50
    assert report.fallback_reason == ""
    np.testing.assert_array_equal(plan.thrusts, steps_by_hand(report.sqp_steps).thrusts)


def test_at_the_start_the_number_of_steps_is_limited() -> None:
    _, report = solve(make_solver(start=(1e-12, 4)))
    assert (report.state, report.sqp_steps) == (SolverState.STEP_LIMIT, 4)


@pytest.mark.parametrize("limit", [1, 2, 5])
def test_in_flight_the_number_of_steps_is_limited(limit: int) -> None:
    plan, report = solve(started(make_solver(flight=(1e-12, limit))))
    assert (report.state, report.sqp_steps) == (SolverState.STEP_LIMIT, limit)
    np.testing.assert_array_equal(plan.thrusts, steps_by_hand(limit, NEXT, NEXT_GEOMETRY).thrusts)


def test_in_flight_it_stops_at_its_own_tolerance() -> None:
    _, first = solve(started(make_solver(flight=(1e-12, 1))))
    _, report = solve(started(make_solver(flight=(2.0 * first.kkt, 10))))
    assert (report.state, report.sqp_steps) == (SolverState.SOLVED, 1)
    assert report.kkt == report.kkt_first == first.kkt


def test_the_time_budget_is_for_the_steps_after_the_first() -> None:
    """The clock is read before the first step and after each, and advances by 0.01 s in between."""
    for budget, steps in ((0.0, 1), (0.0105, 2), (0.0205, 3), (math.inf, 5)):
        solver = started(make_solver(flight=(1e-12, 5), time_budget=budget, tick=0.01))
        plan, report = solve(solver)
        assert (report.state, report.sqp_steps) == (SolverState.STEP_LIMIT, steps)
        np.testing.assert_array_equal(plan.thrusts, steps_by_hand(steps, NEXT, NEXT_GEOMETRY).thrusts)


def test_the_time_budget_does_not_hold_at_the_start() -> None:
    assert solve(make_solver(start=(1e-3, 50), time_budget=0.0))[1].state is SolverState.SOLVED


@pytest.mark.parametrize("count", [1, 4])
def test_a_replay_takes_as_many_steps_as_were_recorded_whatever_the_limits(count: int) -> None:
    solver = started(make_solver(flight=(1e12, 2), time_budget=0.0))
    plan, report = solve(solver, sqp_steps=count)
    assert report.sqp_steps == count
    np.testing.assert_array_equal(plan.thrusts, steps_by_hand(count, NEXT, NEXT_GEOMETRY).thrusts)


def test_times_are_reported() -> None:
    _, report = solve(make_solver(start=(1e12, 50), tick=0.25))
    assert report.prepare_time == pytest.approx(0.25)
    assert report.feedback_time > 0.0


def test_iterations_of_all_quadratic_programs_are_counted() -> None:
    _, one = solve(started(make_solver(flight=(1e-12, 1))))
    _, three = solve(started(make_solver(flight=(1e-12, 3))))
    assert one.qp_iterations >= 1
    assert three.qp_iterations >= one.qp_iterations + 2


def test_a_next_step_needs_a_plan() -> None:
    with pytest.raises(RuntimeError, match="needs a solve"):
        make_solver().prepare_next()


def test_the_prediction_is_where_the_shifted_plan_starts() -> None:
    solver = make_solver()
    plan, _ = solve(solver)
    predicted = solver.prepare_next()
    expected, geometry = following(plan)
    np.testing.assert_array_equal(predicted.states, expected.states[:, 0])
    np.testing.assert_array_equal(predicted.geometry.p_I1I2_I1, geometry.p_I1I2_I1)


def not_finite(part: slice) -> Array:
    states = PROBLEM.initial_states.copy()
    states[0, part] = np.nan
    return states


@pytest.mark.parametrize("warm_start", ["transform", "shift", "hold", "cold"])
def test_a_failed_step_flies_the_plan_of_the_step_before_and_reports_the_reason(warm_start: str) -> None:
    solver = started(make_solver(warm_start=warm_start))
    plan, report = solve(solver, not_finite(layout.VELOCITY))
    np.testing.assert_array_equal(plan.thrusts, NEXT.thrusts)
    np.testing.assert_array_equal(plan.states, NEXT.states)
    assert (report.state, report.sqp_steps, report.sqp_steps_begun) == (SolverState.FALLBACK, 0, 1)
    assert report.fallback_reason
    assert math.isnan(report.kkt)
    assert math.isnan(report.objective)
    assert report.active_bounds == 0


def test_after_a_failure_it_starts_afresh_at_the_measured_state() -> None:
    """Like the first step of a flight: from a hover, to the tolerance of the start."""
    solver = started(make_solver(flight=(1e12, 1)))
    solve(solver, not_finite(layout.RATE))
    solver.prepare_next()
    plan, report = solve(solver)
    assert report.state is SolverState.SOLVED
    assert report.sqp_steps > 1
    np.testing.assert_array_equal(plan.thrusts, FIRST.thrusts)
    solver.prepare_next()
    assert solve(solver)[1].sqp_steps == 1  # the limits of a flight apply again


class Tampered:
    """A solver, but its preparations can be spoilt."""

    def __init__(self) -> None:
        self._real = solver_of(PROBLEM.ocp)
        self.guess: Plan | None = None
        """To prepare instead of what is asked for."""
        self.prepares_left = 10**6
        """Preparations after these fail."""

    def set_weights(self, weights: WeightsConfig) -> None:
        self._real.set_weights(weights)

    def prepare(self, guess: Plan, geometry: TeamGeometry) -> None:
        self.prepares_left -= 1
        if self.prepares_left < 0:
            raise QpError("the Hessian is not positive definite")
        self._real.prepare(guess if self.guess is None else self.guess, geometry)

    def feedback(self, *arguments: Any) -> SqpStep:
        return self._real.feedback(*arguments)


def test_a_plan_that_cannot_be_prepared_does_not_stay_the_guess() -> None:
    """A guess that cannot be linearised used to be shifted for the rest of the flight."""
    tampered = Tampered()
    solver = started(make_solver(solver=tampered))
    wild = NEXT.states.copy()
    wild[:, 2, layout.PITCH] = np.nan
    solve(solver)
    tampered.guess = dataclasses.replace(NEXT, states=wild)
    solver.prepare_next()
    tampered.guess = None
    states = []
    for _ in range(2):
        states.append(solve(solver)[1].state)
        solver.prepare_next()
    assert states == [SolverState.FALLBACK, SolverState.SOLVED]


def test_repeated_failures_fly_the_plan_to_its_end() -> None:
    solver = started(make_solver())
    expected = FIRST
    for _ in range(8):  # more than the horizon
        expected, _ = following(expected)
        plan, report = solve(solver, not_finite(layout.VELOCITY))
        assert report.state is SolverState.FALLBACK
        np.testing.assert_array_equal(plan.thrusts, expected.thrusts)
        solver.prepare_next()
    assert solve(solver)[1].state is SolverState.SOLVED


def test_a_failure_after_a_good_step_flies_what_that_step_found() -> None:
    tampered = Tampered()
    solver = started(make_solver(flight=(1e-12, 3), solver=tampered))
    expected = steps_by_hand(1, NEXT, NEXT_GEOMETRY)
    tampered.prepares_left = 0  # the first step is prepared already
    plan, report = solve(solver)
    np.testing.assert_array_equal(plan.thrusts, expected.thrusts)
    assert (report.state, report.sqp_steps, report.sqp_steps_begun) == (SolverState.FALLBACK, 1, 2)
    assert report.fallback_reason == "the Hessian is not positive definite"
    assert math.isfinite(report.kkt)


def test_a_replay_of_a_failure_fails_in_the_same_step() -> None:
    """So the next control step starts afresh in the replay too."""
    tampered = Tampered()
    solver = started(make_solver(flight=(1e-12, 3), solver=tampered))
    tampered.prepares_left = 0
    assert solve(solver, sqp_steps=2)[1].state is SolverState.FALLBACK


def test_steps_that_diverge_from_a_fresh_guess_leave_the_first_one() -> None:
    """The step from the hover is sound, so the next control step starts from its plan."""
    tampered = Tampered()
    solver = started(make_solver(flight=(1e12, 1), solver=tampered))
    solve(solver, not_finite(layout.RATE))
    solver.prepare_next()
    tampered.prepares_left = 2
    plan, report = solve(solver)
    tampered.prepares_left = 10**6
    assert (report.state, report.sqp_steps, report.sqp_steps_begun) == (SolverState.STEP_LIMIT, 2, 3)
    assert report.fallback_reason == "the Hessian is not positive definite"
    assert report.kkt == report.kkt_first
    np.testing.assert_array_equal(plan.thrusts, steps_by_hand(1).thrusts)
    solver.prepare_next()
    expected = steps_by_hand(1, *following(plan))
    np.testing.assert_array_equal(solve(solver)[0].thrusts, expected.thrusts)


def test_after_a_failed_start_the_next_step_is_a_start() -> None:
    solver = make_solver(start=(1e-3, 50), flight=(1e-12, 1))
    assert solve(solver, not_finite(layout.VELOCITY))[1].state is SolverState.FALLBACK
    solver.prepare_next()
    assert solve(solver)[1].sqp_steps > 1


class StandStill:
    """A solver without a model: the plan is the guess."""

    def set_weights(self, weights: WeightsConfig) -> None:
        pass

    def prepare(self, guess: Plan, geometry: TeamGeometry) -> None:
        self._guess = guess

    def feedback(self, *arguments: Any) -> SqpStep:
        return SqpStep(self._guess, kkt=0.0, objective=1.5, qp_iterations=0, active_bounds=0)


def test_another_solver_can_be_injected() -> None:
    solver = make_solver(solver=StandStill())
    plan, report = solve(solver)
    np.testing.assert_array_equal(plan.thrusts, HOVER.thrusts)
    assert (report.state, report.sqp_steps, report.objective) == (SolverState.SOLVED, 1, 1.5)
    solver.prepare_next()
    np.testing.assert_array_equal(solve(solver)[0].states, following(HOVER)[0].states)
