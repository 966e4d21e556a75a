"""Errors of estimates against numbers worked out by hand, and their consistency against SciPy."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats
from scipy.spatial.transform import Rotation

from relform_analysis.flight.estimation_errors import (
    Consistency,
    EstimationErrors,
    leader_estimation_errors,
    nis_bounds,
    pair_estimation_errors,
)
from relform_analysis.flight.log import FlightLog
from support.logs import perfect_builder
from support.scenarios import paper_scenario


@pytest.fixture
def log() -> FlightLog:
    """Vehicles at their places with a yaw of 1.5 rad; estimates are 0.01 m and 0.25 rad too large."""
    return perfect_builder(paper_scenario(), ["A"] * 4).build()


def test_errors_of_pairs_are_estimate_minus_truth(log: FlightLog) -> None:
    between = pair_estimation_errors(log)
    assert between.errors.shape == (4, 3, 4)
    np.testing.assert_allclose(between.errors, np.broadcast_to([0.01, 0.01, 0.01, 0.25], (4, 3, 4)))
    np.testing.assert_allclose(between.deviations[2, 1], [0.01, 0.02, 0.03, 0.05])


def test_yaw_errors_are_wrapped(log: FlightLog) -> None:
    log.q_NB[:, 1] = Rotation.from_euler("ZYX", [1.5 - 3.0, 0.1, 0.2]).as_quat()
    log.yaw_BB__est[:, 0, 1] = 3.0
    (yaw_error, *_) = pair_estimation_errors(log).errors[0, :, 3]
    assert yaw_error == pytest.approx(6.0 - 2.0 * np.pi)


def test_errors_of_the_leader(log: FlightLog) -> None:
    leader = leader_estimation_errors(log)
    np.testing.assert_allclose(leader.errors, np.broadcast_to([0.02, 0.0, -0.03, -0.02], (4, 4)))
    np.testing.assert_allclose(leader.deviations[0], [0.02, 0.04, 0.06, 0.1])


def test_nees_by_hand(log: FlightLog) -> None:
    between = pair_estimation_errors(log)
    np.testing.assert_allclose(between.position_nees(), 1.0 + 0.25 + 1.0 / 9.0)
    np.testing.assert_allclose(between.yaw_nees(), 25.0)
    consistency = Consistency.of(log, np.array([False, True, True, False]))
    assert consistency.position_nees == pytest.approx((1.0 + 0.25 + 1.0 / 9.0) / 3.0)
    assert consistency.yaw_nees == pytest.approx(25.0)
    assert consistency.leader_nees == pytest.approx((1.0 + 0.25) / 3.0)
    assert consistency.nis_inside == 1.0


def test_nees_of_right_covariances_is_one() -> None:
    generator = np.random.default_rng(5)
    root = generator.normal(size=(4, 4))
    errors = generator.normal(size=(2000, 3, 4)) @ root.T
    right = EstimationErrors(errors, np.broadcast_to(root @ root.T, (2000, 3, 4, 4)))
    low, high = stats.chi2.interval(0.999, df=3 * 6000)
    assert low < right.position_nees().sum() < high
    assert stats.kstest(right.yaw_nees().reshape(-1), stats.chi2(1).cdf).pvalue > 1e-3


def test_bounds_are_those_of_scipy() -> None:
    dof = np.array([3.0, 18.0, 168.0])
    np.testing.assert_allclose(nis_bounds(dof), stats.chi2.interval(0.95, dof), rtol=1e-9)
    assert np.isnan(nis_bounds(np.array([0.0, np.nan]))).all()


def test_share_of_the_nis_inside_its_bounds(log: FlightLog) -> None:
    low, high = stats.chi2.interval(0.95, 18)
    log.estimator["nis"][:] = [low - 0.1, low + 0.1, high + 0.1, np.nan]
    everywhere = np.ones(4, dtype=bool)
    assert Consistency.of(log, everywhere).nis_inside == pytest.approx(1.0 / 3.0)
    log.estimator["nis_dof"][1] = 0.0
    assert Consistency.of(log, everywhere).nis_inside == 0.0


def test_unknown_covariances_give_no_number(log: FlightLog) -> None:
    blind = replace(log, pair_covariance=np.full_like(log.pair_covariance, np.nan))
    blind.estimator["nis_dof"][:] = 0.0
    consistency = Consistency.of(blind, np.ones(4, dtype=bool))
    assert np.isnan([consistency.position_nees, consistency.yaw_nees, consistency.nis_inside]).all()
    assert consistency.leader_nees == pytest.approx((1.0 + 0.25) / 3.0)
