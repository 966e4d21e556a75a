"""The errors of the team estimator against the chi-square distributions that its covariances promise."""

from collections.abc import Sequence

import numpy as np
import pytest
from scipy.stats import chi2

from relform_controller.estimation import team_model
from relform_controller.estimation.team_belief import Belief
from relform_core.arrays import Array
from support.consistency import JudgedStep, judged_steps, relative_nees
from support.scenarios import paper_scenario
from support.sweeps import short_phases

SEEDS = (21, 22, 23, 24)
SECONDS = 6.0
NOMINAL = ""
THRUST_LOSS = "{kind: thrust_scale, target: follower_1, start_s: 3.0, end_s: 6.0, scale: 0.9}"
WIND = "{kind: wind, target: follower_2, start_s: 3.0, end_s: 6.0, force_n: [0.3, 0.4, 0.0]}"


def flown(events: str) -> list[list[JudgedStep]]:
    scenario = paper_scenario("controller=team", short_phases(SECONDS), f"events=[{events}]")
    return [list(judged_steps(scenario.with_seed(seed))) for seed in SEEDS]


def nees(flights: Sequence[Sequence[JudgedStep]], state: str) -> Array:
    """After the start, shape (flight, step, follower)."""
    return np.array([[step.nees[state] for step in flight if step.time > 1.0] for flight in flights])


@pytest.fixture(scope="module")
def nominal() -> list[list[JudgedStep]]:
    return flown(NOMINAL)


def test_average_errors_of_the_papers_noise(nominal: list[list[JudgedStep]]) -> None:
    averages = {state: nees(nominal, state).mean() for state in ("position", "velocity", "yaw")}
    assert 0.65 < averages["position"] < 1.1
    assert 0.65 < averages["yaw"] < 1.2
    assert 0.45 < averages["velocity"] < 1.1  # careful: there may be forces, and the simulation has none


@pytest.mark.parametrize("event", [THRUST_LOSS, WIND], ids=["thrust_loss", "wind"])
def test_average_errors_after_a_change_of_forces(event: str) -> None:
    """The filter must not become sure of a velocity that the force has already changed."""
    flights = flown(event)
    for state in ("position", "velocity", "yaw"):
        assert nees(flights, state).mean() < 1.3
    after = [[step.nees["velocity"] for step in flight if 3.0 < step.time < 4.0] for flight in flights]
    assert np.mean(after) < 3.0


def test_innovations_are_chi_square_distributed(nominal: list[list[JudgedStep]]) -> None:
    reports = [step.report for flight in nominal for step in flight if step.time > 1.0]
    sums, dof = (np.array([getattr(report, name) for report in reports]) for name in ("nis", "nis_dof"))
    low, high = chi2.interval(0.95, dof)
    assert 0.90 < np.mean((low <= sums) & (sums <= high)) < 0.99
    low, high = chi2.interval(0.9999, dof.sum())
    assert low < sums.sum() < high


def test_draws_from_the_belief_itself_are_judged_right() -> None:
    """With errors drawn from the covariance, the average is that of chi-square."""
    generator = np.random.default_rng(5)
    n, size = 4, 4 * team_model.N_FILTER_STATE
    factor = 0.01 * np.eye(size) + 0.005 * generator.standard_normal((size, size))
    belief = Belief(generator.standard_normal((n, team_model.N_FILTER_STATE)), factor)
    draws = [
        relative_nees(belief, belief.states - (factor @ generator.standard_normal(size)).reshape(n, -1))
        for _ in range(2000)
    ]
    for state, dof in {"position": 3, "velocity": 3, "yaw": 1}.items():
        values = dof * np.array([draw[state][0] for draw in draws])
        low, high = chi2.interval(0.9999, dof * len(values))
        assert low < values.sum() < high
        assert np.mean(values < chi2.ppf(0.9, dof)) == pytest.approx(0.9, abs=0.03)
