"""A solver that fails in flight: the last plan is flown to its end, then the vehicles stop safely."""

import dataclasses
import itertools
import math
from collections.abc import Callable, Iterator

import numpy as np
import pytest

from relform_analysis.flight.simulate import SimulatedStep, simulate
from relform_controller.blas import one_blas_thread
from relform_controller.flight_director import FlightDirector
from relform_controller.formation_controller import FormationController
from relform_controller.ocp.problem import HorizonReference, HorizonStart, Ocp, Plan, TeamGeometry
from relform_controller.solver.make import make_solver
from relform_controller.solver.solver import SqpStep
from relform_core.controller_config import WeightsConfig
from relform_core.flight_modes import TeamMode
from relform_core.load import LoadedScenario
from relform_core.names import SolverState
from support.nodes import short
from support.scenarios import FROM_GROUND, paper_scenario

CONSTRAINED = (
    "controller=team",
    "controller.constraints={tilt: {max_deg: 30.0, price_per_unit: 300.0, square_price_per_unit2: 1000.0}}",
)
"""With soft constraints the interior-point method solves the quadratic programs, and says when it cannot."""
FIRST = 40
"""The first control step in which the solver fails."""


class Infeasible:
    """A solver that can be given bounds on the thrusts that contradict each other (``Solver``)."""

    is_now = False

    def __init__(self, ocp: Ocp) -> None:
        self._feasible = make_solver(ocp)
        self._infeasible = make_solver(dataclasses.replace(ocp, thrust_min=4.0, thrust_max=1.0))

    def set_weights(self, weights: WeightsConfig) -> None:
        for each in (self._feasible, self._infeasible):
            each.set_weights(weights)

    def prepare(self, guess: Plan, geometry: TeamGeometry) -> None:
        for each in (self._feasible, self._infeasible):
            each.prepare(guess, geometry)

    def feedback(self, start: HorizonStart, geometry: TeamGeometry, reference: HorizonReference) -> SqpStep:
        solver = self._infeasible if Infeasible.is_now else self._feasible
        return solver.feedback(start, geometry, reference)


@pytest.fixture(autouse=True)
def feasible() -> Iterator[None]:
    yield
    Infeasible.is_now = False


def flown(scenario: LoadedScenario, fails: Callable[[int], bool]) -> list[SimulatedStep]:
    """A flight whose solver fails in some control steps."""
    steps = []
    with one_blas_thread():
        flight = simulate(scenario, FormationController(scenario.config, solver=Infeasible))
        for step in itertools.count():
            Infeasible.is_now = fails(step)
            if (found := next(flight, None)) is None:
                return steps
            steps.append(found)
    raise AssertionError


def tilt_deg(step: SimulatedStep) -> float:
    """The largest tilt of a vehicle."""
    return max(
        math.degrees(math.acos(min(1.0, 1.0 - 2.0 * (x * x + y * y))))
        for x, y, _, _ in (truth.q_NB for truth in step.ground_truth.values())
    )


def apart(step: SimulatedStep) -> np.ndarray:
    """Where the followers are from the leader [m], in {n}."""
    places = [truth.p_NB_N for truth in step.ground_truth.values()]
    return np.array([place - places[0] for place in places[1:]])


def test_a_short_failure_flies_the_plan_before_and_is_reported() -> None:
    scenario = paper_scenario(short(5.0), *CONSTRAINED, seed=3)
    steps = flown(scenario, lambda step: FIRST <= step < FIRST + 8)
    decisions = [step.decision for step in steps[:-1]]
    last_good = decisions[FIRST - 1]
    assert last_good is not None
    for later, decision in enumerate(decisions[FIRST : FIRST + 8]):
        assert decision is not None
        assert decision.solver.state is SolverState.FALLBACK
        assert "the interior-point method did not converge" in decision.solver.fallback_reason
        for name, command in decision.commands.items():
            planned = last_good.commands[name].predicted_speeds
            np.testing.assert_array_equal(command.speeds, planned[later])
            np.testing.assert_array_equal(command.predicted_speeds, planned[later + 1 :])
    assert not steps[-1].faults
    assert all(d is not None and d.solver.state is not SolverState.FALLBACK for d in decisions[FIRST + 8 :])
    assert np.abs(apart(steps[-1]) - apart(steps[FIRST])).max() < 0.05


def test_when_the_plan_is_over_the_vehicles_sink_level_until_the_solver_succeeds_again() -> None:
    scenario = paper_scenario(short(6.0), *CONSTRAINED, seed=3)
    horizon = scenario.config.controller.horizon_steps
    last = FIRST + horizon + 20
    steps = flown(scenario, lambda step: FIRST <= step < last)
    n_commands = [len(step.decision.commands) for step in steps[:-1] if step.decision is not None]
    assert n_commands[FIRST : FIRST + horizon - 1] == [3] * (horizon - 1)
    assert n_commands[FIRST + horizon - 1 : last] == [0] * 21
    assert n_commands[last:] == [3] * (len(n_commands) - last)
    assert not steps[-1].faults
    assert max(map(tilt_deg, steps[FIRST : last + 5])) < 15.0
    assert np.abs(apart(steps[-1]) - apart(steps[FIRST])).max() < 0.2


def test_a_team_whose_solver_does_not_succeed_again_lands() -> None:
    scenario = paper_scenario(FROM_GROUND, *CONSTRAINED, seed=3)
    director = FlightDirector(scenario.config, solver=Infeasible)
    modes: list[TeamMode] = []
    with one_blas_thread():
        for step in simulate(scenario, director):
            assert not step.faults
            Infeasible.is_now = director.mode is TeamMode.FLYING
            if director.mode not in modes[-1:]:
                modes.append(director.mode)
            if modes[-2:] == [TeamMode.FAILSAFE, TeamMode.IDLE]:
                break
    assert modes[-2:] == [TeamMode.FAILSAFE, TeamMode.IDLE]
    assert director.reason.startswith("no plan is left: the interior-point method did not converge")


def test_without_time_one_sqp_step_is_taken_and_the_flight_goes_on() -> None:
    """A clock by which each SQP step takes a second, for a while."""
    scenario = paper_scenario(short(4.0), seed=3)
    times, seconds = itertools.count(), [0.0]

    def clock() -> float:
        seconds[0] += 1.0 if 200 < next(times) < 350 else 1e-6
        return seconds[0]

    controller = FormationController(scenario.config, clock, time_budget=0.01)
    with one_blas_thread():
        steps = list(simulate(scenario, controller))
    reports = [step.decision.solver for step in steps[:-1] if step.decision is not None]
    late = [report for report in reports if report.feedback_time > 0.5][1:-1]  # it is slow from begin to end
    assert len(late) > 20
    assert all(report.sqp_steps == 1 and report.state is not SolverState.FALLBACK for report in late)
    assert not steps[-1].faults
