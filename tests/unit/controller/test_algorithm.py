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


class Scripted:
    """A solver without a model: its SQP steps have these KKT values; the k-th plan has the thrusts k."""

    def __init__(self, *kkt: float) -> None:
        self._kkt = kkt
        self._taken = 0
        self.guesses: list[Plan] = []

    def set_weights(self, weights: WeightsConfig) -> None:
        pass

    def prepare(self, guess: Plan, geometry: TeamGeometry) -> None:
        self.guesses.append(guess)

    def feedback(self, *arguments: Any) -> SqpStep:
        kkt = self._kkt[self._taken]
        self._taken += 1
        if math.isnan(kkt):
            raise QpError("not solved")
        plan = dataclasses.replace(self.guesses[-1], thrusts=np.full_like(HOVER.thrusts, self._taken))
        return SqpStep(plan, kkt, objective=1.5, qp_iterations=1, active_bounds=0)


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
    falling = Scripted(1e-4, *(1.0 / step for step in range(1, 10)))
    plan, report = solve(started(make_solver(flight=(1e-12, limit), solver=falling)))
    assert (report.state, report.sqp_steps) == (SolverState.STEP_LIMIT, limit)
    np.testing.assert_array_equal(plan.thrusts, 1.0 + limit)


def test_in_flight_steps_start_from_the_plan_before() -> None:
    plan, report = solve(started(make_solver(flight=(1e-12, 2))))
    assert (report.state, report.sqp_steps) == (SolverState.STEP_LIMIT, 2)
    np.testing.assert_array_equal(plan.thrusts, steps_by_hand(2, NEXT, NEXT_GEOMETRY).thrusts)


def test_in_flight_it_stops_at_its_own_tolerance() -> None:
    _, first = solve(started(make_solver(flight=(1e-12, 1))))
    _, report = solve(started(make_solver(flight=(2.0 * first.kkt, 10))))
    assert (report.state, report.sqp_steps) == (SolverState.SOLVED, 1)
    assert report.kkt == report.kkt_first == first.kkt


def test_the_time_budget_is_for_the_steps_after_the_first() -> None:
    """The clock is read before the first step and after each, and advances by 0.01 s in between."""
    for budget, steps in ((0.0, 1), (0.0105, 2), (0.0205, 3), (math.inf, 5)):
        falling = Scripted(1e-4, *(1.0 / step for step in range(1, 10)))
        solver = started(make_solver(flight=(1e-12, 5), time_budget=budget, tick=0.01, solver=falling))
        plan, report = solve(solver)
        assert (report.state, report.sqp_steps) == (SolverState.STEP_LIMIT, steps)
        np.testing.assert_array_equal(plan.thrusts, 1.0 + steps)


def test_the_time_budget_does_not_hold_at_the_start() -> None:
    assert solve(make_solver(start=(1e-3, 50), time_budget=0.0))[1].state is SolverState.SOLVED


@pytest.mark.parametrize("count", [1, 4])
def test_a_replay_takes_as_many_steps_as_were_recorded_whatever_the_limits(count: int) -> None:
    falling = Scripted(1e-4, *(1.0 / step for step in range(1, 10)))
    solver = started(make_solver(flight=(1e12, 2), time_budget=0.0, solver=falling))
    plan, report = solve(solver, sqp_steps=count)
    assert report.sqp_steps == count
    np.testing.assert_array_equal(plan.thrusts, 1.0 + count)


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
    assert (report.state, report.sqp_steps) == (SolverState.FALLBACK, 1 if warm_start == "cold" else 2)
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
        self.fails_once = False
        """Whether the next preparation fails."""

    def set_weights(self, weights: WeightsConfig) -> None:
        self._real.set_weights(weights)

    def prepare(self, guess: Plan, geometry: TeamGeometry) -> None:
        if self.fails_once:
            self.fails_once = False
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
    assert states == [SolverState.SOLVED, SolverState.SOLVED]  # the first one from a hover


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


def test_a_step_that_fails_is_followed_by_a_start_in_the_same_control_step() -> None:
    tampered = Tampered()
    solver = started(make_solver(flight=(1e-12, 3), solver=tampered))
    tampered.fails_once = True
    plan, report = solve(solver)
    assert report.state is SolverState.SOLVED
    assert report.fallback_reason == "the Hessian is not positive definite"
    np.testing.assert_array_equal(plan.thrusts, FIRST.thrusts)
    assert report.sqp_steps == 2 + solve(make_solver())[1].sqp_steps  # one succeeded, one failed


def test_steps_that_diverge_from_the_plan_are_followed_by_a_start() -> None:
    solver = make_solver(flight=(1.0, 3), solver=(scripted := Scripted(1e-4, 40.0, 50.0, 7.0, 9.0, 1e-4)))
    plan, report = solve(started(solver))
    assert (report.state, report.sqp_steps, report.kkt_first, report.kkt) == (
        SolverState.SOLVED,
        5,
        40.0,
        1e-4,
    )
    assert report.fallback_reason == "SQP steps diverge: KKT value 40, then 50"
    np.testing.assert_array_equal(plan.thrusts, 6.0)
    np.testing.assert_array_equal(scripted.guesses[3].thrusts, HOVER_THRUST)
    solver.prepare_next()
    np.testing.assert_array_equal(scripted.guesses[-1].thrusts, 6.0)  # the next control step is no start


def test_a_kkt_value_that_grows_below_the_tolerance_is_no_divergence() -> None:
    _, report = solve(started(make_solver(flight=(1.0, 3), solver=Scripted(1e-4, 0.2))))
    assert (report.state, report.sqp_steps) == (SolverState.SOLVED, 1)


@pytest.mark.parametrize(
    ("kkt", "best", "begun"),
    [((3.0, 2.0, 5.0, 8.0), 2.0, 4), ((3.0, 5.0, math.nan), 1.0, 3)],
    ids=["they diverge", "a later one fails"],
)
def test_of_steps_from_a_hover_the_one_with_the_lowest_kkt_value_is_flown(
    kkt: tuple[float, ...], best: float, begun: int
) -> None:
    plan, report = solve(make_solver(start=(1e-3, 4), solver=Scripted(*kkt)))
    assert (report.state, report.sqp_steps) == (SolverState.STEP_LIMIT, begun)
    assert report.kkt == kkt[int(best) - 1]
    np.testing.assert_array_equal(plan.thrusts, best)


def test_without_time_for_a_start_the_plan_before_is_flown_and_the_next_step_is_a_start() -> None:
    scripted = Scripted(1e-4, 40.0, 50.0, 1e-4)
    solver = started(make_solver(flight=(1.0, 3), time_budget=0.015, tick=0.01, solver=scripted))
    plan, report = solve(solver)
    assert (report.state, report.sqp_steps) == (SolverState.FALLBACK, 2)
    np.testing.assert_array_equal(plan.thrusts, 1.0)
    solver.prepare_next()
    plan, report = solve(solver)
    assert report.state is SolverState.SOLVED
    np.testing.assert_array_equal(scripted.guesses[-1].thrusts, HOVER_THRUST)


@pytest.mark.parametrize("begun", [2, 3, 4])
def test_a_replay_starts_again_where_the_flight_did(begun: int) -> None:
    """With two steps the flight had no time for a start; the steps of a start count too."""
    solver = started(make_solver(flight=(1.0, 3), solver=Scripted(1e-4, 40.0, 50.0, 7.0, 6.0)))
    plan, report = solve(solver, sqp_steps=begun)
    assert (report.state is SolverState.FALLBACK) == (begun == 2)
    assert report.sqp_steps == begun
    np.testing.assert_array_equal(plan.thrusts, {2: 1.0, 3: 4.0, 4: 5.0}[begun])


def test_after_a_failed_start_the_next_step_is_a_start() -> None:
    solver = make_solver(start=(1e-3, 50), flight=(1e-12, 1))
    assert solve(solver, not_finite(layout.VELOCITY))[1].state is SolverState.FALLBACK
    solver.prepare_next()
    assert solve(solver)[1].sqp_steps > 1


def test_a_skipped_step_shifts_the_plan_once_more() -> None:
    shifted = shift(NEXT, predictor(PROBLEM.ocp), PROBLEM.ocp)
    plan, geometry = transform(shifted, NEXT_GEOMETRY, PROBLEM.ocp.pairs)
    prediction = started(make_solver()).skip(1)
    assert np.array_equal(prediction.states, plan.states[:, 0])
    assert np.array_equal(prediction.geometry.p_I1I2_I1, geometry.p_I1I2_I1)


def test_a_skip_needs_a_plan() -> None:
    with pytest.raises(RuntimeError, match="skip"):
        make_solver().skip(1)
