"""A team estimator whose filter fails in flight begins anew, and the flight goes on."""

from collections.abc import Collection, Iterator
from typing import Any

import numpy as np
import pytest

from relform_analysis.flight.simulate import SimulatedStep, simulate
from relform_controller.blas import one_blas_thread
from relform_controller.estimation.team import TeamEstimator
from relform_controller.estimation.team_belief import Belief, Innovation
from relform_controller.estimation.team_kernel import make_team_filter
from relform_controller.formation_controller import FormationController
from relform_controller.ocp.model import RigidBody
from relform_core.errors import FlightError
from relform_core.load import LoadedScenario
from support.nodes import short
from support.scenarios import paper_scenario


class Failing:
    """A team filter that cannot predict in some control steps (``TeamFilter``)."""

    def __init__(
        self,
        scenario: LoadedScenario,
        steps: Collection[int],
        *,
        silently: bool = False,
        corrects: bool = True,
    ) -> None:
        config = scenario.config
        self._filter = make_team_filter(RigidBody.from_config(config.vehicle), len(config.team.vehicles))
        self._steps = steps
        self._silently = silently
        self._corrects = corrects
        self.step = 0

    def __getattr__(self, name: str) -> Any:
        return getattr(self._filter, name)

    def predict(self, belief: Belief, *arguments: Any) -> Belief:
        if self.step not in self._steps:
            return self._filter.predict(belief, *arguments)
        if self._silently:
            return Belief(np.full_like(belief.states, np.nan), belief.factor)
        raise np.linalg.LinAlgError("the covariance of the team is not positive definite")

    def correct(self, belief: Belief, innovation: Innovation) -> Belief:
        if self._corrects or self.step not in self._steps:
            return self._filter.correct(belief, innovation)
        raise np.linalg.LinAlgError("the covariance of the team is not positive definite")


def flown(scenario: LoadedScenario, failing: Failing) -> Iterator[SimulatedStep]:
    estimator = TeamEstimator(scenario.config, failing)
    with one_blas_thread():
        for step in simulate(scenario, FormationController(scenario.config, estimator=estimator)):
            yield step
            failing.step = step.measurements.step + 1


@pytest.mark.parametrize("silently", [False, True], ids=["by an error", "by NaN"])
def test_it_begins_anew_while_the_team_moves(silently: bool) -> None:
    """In a hover, on the straight, in the turn and in the spiral."""
    scenario = paper_scenario("controller=team", seed=2)
    times = [15, 100, 125, 400]
    steps = list(flown(scenario, Failing(scenario, times, silently=silently)))
    assert not steps[-1].faults
    assert [step.measurements.step for step in steps[5:-1] if step.decision is None] == times
    decided = [step.decision for step in steps if step.decision is not None]
    reports = [decision.state.estimator for decision in decided]
    assert reports[-1] is not None
    assert reports[-1].restarts == len(times)
    errors = [np.linalg.norm(pair.p_B1B2_C1__est - pair.p_B1B2_C1__ref) for pair in decided[-1].state.pairs]
    assert max(errors) < 0.05


def test_a_filter_that_always_fails_ends_the_flight_with_the_reason() -> None:
    scenario = paper_scenario(short(20.0), "controller=team", "controller.start_wait_max_s=2.0", seed=2)
    reached: list[int] = []
    flight = flown(scenario, Failing(scenario, range(40, 1000), corrects=False))
    with pytest.raises(FlightError, match=r"^the flight cannot go on: after 2 s .* estimate, which begins"):
        reached.extend(step.measurements.step for step in flight)
    assert reached[-1] == 40 + 40 - 1
