"""The first estimate of a team: what it waits for, how well it knows itself, when it can leave its place."""

import dataclasses

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from relform_controller.estimation.estimator import TeamEstimate, Waiting
from relform_controller.estimation.team import TeamEstimator
from relform_core.measurements import TeamMeasurements
from relform_core.sensors.range_bearing import RangeBearing
from support.flights import replaced
from support.starts import estimator_of, measured, resting_team, seen_along, with_sightings
from support.world import POSITION_STD, TrueVehicle

TEAM = resting_team(np.random.default_rng(3), 4)
CHAIN = [(0, 2), (2, 1), (1, 3)]


def at(x: float, y: float, z: float, yaw_deg: float) -> TrueVehicle:
    """A level vehicle at rest."""
    attitude = Rotation.from_euler("z", yaw_deg, degrees=True)
    return TrueVehicle(np.array([x, y, z]), attitude, np.zeros(3), np.zeros(3))


def first(measurements: TeamMeasurements, estimator: TeamEstimator | None = None) -> TeamEstimate | Waiting:
    estimator = estimator_of(len(measurements.by_vehicle)) if estimator is None else estimator
    return estimator.update(measurements, {}, None)


def estimated(measurements: TeamMeasurements, estimator: TeamEstimator | None = None) -> TeamEstimate:
    estimate = first(measurements, estimator)
    assert isinstance(estimate, TeamEstimate), estimate.reason
    return estimate


def reason(measurements: TeamMeasurements, estimator: TeamEstimator | None = None) -> str:
    waiting = first(measurements, estimator)
    assert isinstance(waiting, Waiting)
    return waiting.reason


def test_two_vehicles_by_hand() -> None:
    """The follower is 2 m behind and 1 m below the leader, which looks along y, and looks back at it."""
    estimate = estimated(measured([at(5.0, -3.0, 4.0, 90.0), at(5.0, -5.0, 3.0, -60.0)]))
    np.testing.assert_allclose(estimate.geometry.p_I1I2_I1[0], [-2.0, 0.0, -1.0], atol=1e-6)
    assert np.degrees(estimate.geometry.yaw_I1I2[0]) == pytest.approx(-150.0, abs=1e-4)
    assert estimate.covariances is not None
    variances = np.diag(estimate.covariances.pairs[0])
    assert variances[3] == pytest.approx(2.0 * (POSITION_STD / 2.0) ** 2, rel=2e-3)  # a bearing at each end
    # Across, only what the leader sees counts: what the follower sees goes into its unknown yaw.
    assert variances[1] == pytest.approx(POSITION_STD**2, rel=2e-3)
    assert variances[0] == pytest.approx(POSITION_STD**2 / 2.0, rel=2e-3)


def test_the_followers_are_known_relative_to_a_leader_that_is_lost() -> None:
    """All follow the leader's error: positions relative to it do not get worse."""
    measurements = measured(TEAM)
    localization = measurements.by_vehicle["leader"].by_sensor["localization"][0]
    vague = replaced(
        measurements,
        "leader",
        localization=dataclasses.replace(localization, pose_covariance=np.diag([9.0] * 3 + [0.04] * 3)),
    )
    known, lost = estimated(measurements).covariances, estimated(vague).covariances
    assert known is not None
    assert lost is not None
    horizontal = np.ix_(range(12), [0, 1, 3], [0, 1, 3])  # sonars tie the heights to the ground
    np.testing.assert_allclose(lost.pairs[horizontal], known.pairs[horizontal], rtol=1e-2, atol=1e-7)
    assert lost.leader[0, 0] > 100.0 * known.leader[0, 0]


def test_yaws_along_a_chain_add_up() -> None:
    """Vehicles in a line, 2 m apart: every link adds the variance of two bearings."""
    line = [at(2.0 * k, 0.0, 3.0, 100.0 * k) for k in range(4)]
    links = [(0, 1), (1, 2), (2, 3)]
    covariances = estimated(seen_along(measured(line), links)).covariances
    assert covariances is not None
    one_link = 2.0 * (POSITION_STD / 2.0) ** 2
    np.testing.assert_allclose(covariances.pairs[:3, 3, 3], one_link * np.array([1, 2, 3]), rtol=2e-3)


def test_sightings_of_several_steps_place_a_team() -> None:
    """In each step only one link of the chain is seen."""
    estimator = estimator_of(4)
    for step, link in enumerate(CHAIN):
        measurements = seen_along(measured(TEAM, step), [link])
        last = first(measurements, estimator)
        assert isinstance(last, TeamEstimate) == (step == 2)
    assert isinstance(last, TeamEstimate)
    expected = TEAM[0].levelled.inv().apply(TEAM[3].p_NB_N - TEAM[0].p_NB_N)
    np.testing.assert_allclose(last.geometry.p_I1I2_I1[2], expected, atol=1e-3)
    fresh = estimated(seen_along(measured(TEAM), CHAIN)).covariances
    assert fresh is not None
    assert last.covariances is not None
    assert (last.covariances.pairs[:3, 3, 3] > fresh.pairs[:3, 3, 3]).all()  # the team may have moved since


def test_what_is_missing_is_named() -> None:
    measurements = measured(TEAM)
    assert reason(replaced(measurements, "leader", localization=None)) == "localization of leader"
    assert reason(replaced(measurements, "follower_2", imu=None)) == "IMU of follower_2"
    cut = seen_along(measurements, [(0, 2), (1, 3)])
    assert reason(cut) == "mutual range and bearing that connects follower_1 with leader"


def test_a_yaw_that_cannot_be_observed_is_named() -> None:
    above = measured([at(0.0, 0.0, 4.0, 20.0), at(0.0, 0.0, 2.5, 70.0)])
    assert reason(above) == (
        "accurate relative yaw of follower_1 (it is right above or below another, 20 deg are needed)"
    )
    nearly = measured([at(0.0, 0.0, 4.0, 20.0), at(0.0, 0.09, 2.5, 70.0)])
    assert reason(nearly) == "accurate relative yaw of follower_1 (known to 22.5 deg, 20 deg are needed)"
    third = [*[at(0.0, 0.0, 4.0, 20.0), at(0.0, 0.0, 2.5, 70.0)], at(1.5, 0.5, 3.0, 0.0)]
    assert isinstance(first(measured(third)), TeamEstimate)  # another vehicle sees both from the side


def test_contradicting_sightings_are_waited_out() -> None:
    def with_outlier(observer: str, target: str, seen: RangeBearing) -> RangeBearing:
        is_wrong = (observer, target) == ("follower_2", "leader")
        return dataclasses.replace(seen, range=seen.range + 1.0) if is_wrong else seen

    estimator = estimator_of(4)
    contradiction = reason(with_sightings(measured(TEAM), with_outlier), estimator)
    assert contradiction == "range and bearing from follower_2 to leader that fits the others"
    estimate = estimated(measured(TEAM, step=1), estimator)
    assert np.isfinite(estimate.states).all()


def test_the_team_stays_until_its_yaws_are_known() -> None:
    """Its sightings are twenty times less accurate: the first estimates do."""

    def vague(observer: str, target: str, seen: RangeBearing) -> RangeBearing:
        return dataclasses.replace(seen, covariance=400.0 * seen.covariance)

    estimator, reasons = estimator_of(4), []
    for step in range(40):
        measurements = with_sightings(measured(TEAM, step), vague)
        reasons.append(estimated(measurements, estimator).unsettled)
    assert reasons[1] == "settled estimate (0.05 s old, 0.2 s are needed)"
    accurate = [k for k, text in enumerate(reasons) if not text]
    assert accurate == list(range(accurate[0], 40))
    assert accurate[0] > 5
    assert "accurate relative yaw of follower_" in reasons[5]
    assert reasons[5].endswith(" deg, 3 deg are needed)")
