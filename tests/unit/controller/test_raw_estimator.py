"""The paper's feedback: what is measured goes in as it is, what is missing comes from the prediction."""

import dataclasses
import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from relform_controller.estimation.estimator import AppliedInputs, TeamEstimate, Waiting
from relform_controller.estimation.raw import RawEstimator
from relform_controller.ocp import layout
from relform_controller.ocp.problem import Prediction, TeamGeometry
from relform_core.measurements import TeamMeasurements
from relform_core.names import EstimatorMode
from relform_core.sensors.imu import IMU
from relform_core.sensors.optic_flow import OPTIC_FLOW
from relform_core.sensors.range_bearing import RANGE_BEARING
from support.flights import replaced as without
from support.world import GYRO_VARIANCE, TrueVehicle, measure, random_team, relative_position_C

NAMES = ("leader", "follower_1", "follower_2")
PAIRS = layout.ordered_pairs(3)
PERIOD = 0.05
APPLIED = {-50_000_000: AppliedInputs(np.full((3, 4), 1.7), np.zeros((3, 4)))}
YAW_STD_MAX = math.radians(20.0)


class Raw:
    """A raw estimator whose estimate exists, unless a test asks what it waits for."""

    def __init__(self) -> None:
        self._estimator = RawEstimator(NAMES, YAW_STD_MAX, PERIOD)

    def update(self, measurements: TeamMeasurements, predicted: Prediction | None = None) -> TeamEstimate:
        estimate = self._estimator.update(measurements, APPLIED, predicted)
        assert isinstance(estimate, TeamEstimate)
        return estimate

    def missing(self, measurements: TeamMeasurements) -> str:
        estimate = self._estimator.update(measurements, APPLIED, None)
        assert isinstance(estimate, Waiting)
        return estimate.reason


def make_prediction() -> Prediction:
    """Numbers unlike any measurement."""
    states = 0.01 * np.arange(1.0, 1.0 + 3 * layout.N_STATE).reshape(3, layout.N_STATE)
    states[:, layout.POSITION] = states[:, layout.YAW] = 0.0
    geometry = TeamGeometry(
        10.0 + np.arange(18.0).reshape(6, 3), np.linspace(-0.3, 0.3, 6), np.full(3, 7.0), 5.0
    )
    return Prediction(states, geometry)


def blinded(measurements: TeamMeasurements, observer: str, target: str) -> TeamMeasurements:
    """The same, but one vehicle does not see one other."""
    sights = measurements.by_vehicle[observer].newest(RANGE_BEARING)
    assert sights is not None
    others = {name: seen for name, seen in sights.by_target.items() if name != target}
    return without(measurements, observer, range_bearing=dataclasses.replace(sights, by_target=others))


def assert_same(found: TeamEstimate, expected: TeamEstimate, rtol: float = 0.0) -> None:
    np.testing.assert_allclose(found.states, expected.states, rtol=rtol, atol=1e-12)
    np.testing.assert_allclose(found.geometry.p_I1I2_I1, expected.geometry.p_I1I2_I1, rtol=rtol, atol=1e-12)
    np.testing.assert_allclose(found.geometry.yaw_I1I2, expected.geometry.yaw_I1I2, rtol=rtol, atol=1e-12)


@pytest.mark.parametrize("seed", range(5))
def test_perfect_measurements_give_the_truth(seed: int) -> None:
    generator = np.random.default_rng(seed)
    team = random_team(generator, 3, tilt_max=0.9, rate_max=3.0)
    raw = Raw().update(measure(team, NAMES))
    for vehicle, state in zip(team, raw.states, strict=True):
        np.testing.assert_allclose(state, vehicle.state_I(), atol=1e-12)
    for pair, (i, j) in enumerate(PAIRS):
        np.testing.assert_allclose(
            raw.geometry.p_I1I2_I1[pair], relative_position_C(team[i], team[j]), atol=1e-12
        )
        R_I1I2 = team[i].levelled.inv() * team[j].levelled
        np.testing.assert_allclose(
            Rotation.from_euler("z", raw.geometry.yaw_I1I2[pair]).as_matrix(),
            R_I1I2.as_matrix(),
            atol=1e-12,
        )
    np.testing.assert_allclose(raw.geometry.p_NI_N, team[0].p_NB_N)
    assert raw.geometry.yaw_NI == pytest.approx(team[0].yaw)
    assert (raw.report.mode, raw.report.reason) == (EstimatorMode.MEASURED, "")
    assert not any(raw.yaw_held)


def test_the_yaw_of_a_followers_imu_is_not_used() -> None:
    team = random_team(np.random.default_rng(3), 3, tilt_max=0.9)
    plain = Raw().update(measure(team, NAMES))
    for offsets in ((0.0, 1.0, -2.5), (0.0, math.pi, 0.01)):
        assert_same(Raw().update(measure(team, NAMES, yaw_offsets=offsets)), plain)


@pytest.mark.parametrize("name", NAMES)
def test_without_imu_roll_pitch_and_rates_are_the_predicted_ones(name: str) -> None:
    team = random_team(np.random.default_rng(4), 3)
    full, prediction = measure(team, NAMES), make_prediction()
    state = Raw().update(without(full, name, imu=None), prediction).states[NAMES.index(name)]
    predicted = prediction.states[NAMES.index(name)]
    np.testing.assert_array_equal(state[[layout.ROLL, layout.PITCH]], predicted[[layout.ROLL, layout.PITCH]])
    np.testing.assert_array_equal(state[layout.RATE], predicted[layout.RATE])
    # The flow is in the body, so that it is turned by the predicted attitude.
    flow = full.by_vehicle[name].newest(OPTIC_FLOW)
    assert flow is not None
    R_IB = Rotation.from_euler("ZYX", [0.0, predicted[layout.PITCH], predicted[layout.ROLL]])
    np.testing.assert_allclose(state[layout.VELOCITY], R_IB.apply(flow.v_NB_B), atol=1e-12)


@pytest.mark.parametrize("name", NAMES)
def test_without_optic_flow_the_velocity_is_the_predicted_one(name: str) -> None:
    team = random_team(np.random.default_rng(5), 3)
    full, prediction = measure(team, NAMES), make_prediction()
    raw = Raw().update(without(full, name, optic_flow=None), prediction)
    index = NAMES.index(name)
    expected = np.array([vehicle.state_I() for vehicle in team])
    expected[index, layout.VELOCITY] = prediction.states[index, layout.VELOCITY]
    np.testing.assert_allclose(raw.states, expected, atol=1e-12)


def test_without_localization_the_pose_of_the_leader_is_the_predicted_one() -> None:
    team = random_team(np.random.default_rng(6), 3)
    prediction = make_prediction()
    geometry = Raw().update(without(measure(team, NAMES), "leader", localization=None), prediction).geometry
    np.testing.assert_array_equal(geometry.p_NI_N, prediction.geometry.p_NI_N)
    assert geometry.yaw_NI == prediction.geometry.yaw_NI


def test_the_order_of_the_messages_does_not_matter() -> None:
    measurements = measure(random_team(np.random.default_rng(6), 3), NAMES)
    reversed_order = dict(reversed(measurements.by_vehicle.items()))
    assert_same(
        Raw().update(dataclasses.replace(measurements, by_vehicle=reversed_order)),
        Raw().update(measurements),
    )


def test_each_gyro_adds_its_own_noise_to_a_yaw_that_is_held() -> None:
    measurements = measure(random_team(np.random.default_rng(7), 3), NAMES)
    imu = measurements.by_vehicle["follower_1"].newest(IMU)
    assert imu is not None
    better = dataclasses.replace(imu, gyro_covariance=0.25 * imu.gyro_covariance)
    measurements = without(measurements, "follower_1", imu=better)
    raw = Raw()
    before = raw.update(measurements).yaw_variances[PAIRS.index((0, 1))]
    blind = blinded(measurements, "leader", "follower_1")
    after = raw.update(blind, make_prediction()).yaw_variances[PAIRS.index((0, 1))]
    assert after - before == pytest.approx(1.25 * GYRO_VARIANCE * PERIOD**2)


def test_sonar_is_not_used() -> None:
    measurements = measure(random_team(np.random.default_rng(6), 3), NAMES)
    assert_same(
        Raw().update(without(measurements, "follower_1", sonar=None)),
        Raw().update(measurements),
    )


def turned(vehicle: TrueVehicle, yaw_rate: float, time: float) -> TrueVehicle:
    """The vehicle after it turned about the vertical; the constant rates that do this are its ``w_NB_B``."""
    attitude = Rotation.from_euler("z", yaw_rate * time) * vehicle.attitude
    return dataclasses.replace(vehicle, attitude=attitude, w_NB_B=attitude.inv().apply([0.0, 0.0, yaw_rate]))


@pytest.mark.parametrize("blind_both", [False, True])
def test_without_mutual_sight_the_yaw_is_held_with_the_gyros(blind_both: bool) -> None:
    """Tilted vehicles turn about the vertical at different rates; follower_1 is not seen for two seconds."""
    team, yaw_rates = random_team(np.random.default_rng(7), 3), (0.7, -1.9, 2.8)
    raw, prediction = Raw(), make_prediction()
    variance = None
    for step in range(41):
        now = [turned(vehicle, rate, step * PERIOD) for vehicle, rate in zip(team, yaw_rates, strict=True)]
        measurements = measure(now, NAMES, step)
        if step > 0:
            measurements = blinded(measurements, "leader", "follower_1")
            if blind_both:
                measurements = blinded(measurements, "follower_1", "leader")
        found = raw.update(measurements, prediction)
        pair, back = PAIRS.index((0, 1)), PAIRS.index((1, 0))
        R_I1I2 = now[0].levelled.inv() * now[1].levelled
        for index, R in ((pair, R_I1I2), (back, R_I1I2.inv())):
            yaw = Rotation.from_euler("z", found.geometry.yaw_I1I2[index])
            assert (yaw.inv() * R).magnitude() < 1e-9
        assert found.yaw_held == tuple(step > 0 and {i, j} == {0, 1} for i, j in PAIRS)
        assert found.yaw_variances[pair] == found.yaw_variances[back]
        if variance is not None:  # the noise of two gyros over one period
            assert found.yaw_variances[pair] - variance == pytest.approx(2 * GYRO_VARIANCE * PERIOD**2)
        variance = found.yaw_variances[pair]
        # The positions that are not seen are the predicted ones, the others the measured ones.
        unseen = {(0, 1)} | ({(1, 0)} if blind_both else set()) if step > 0 else set()
        for index, (i, j) in enumerate(PAIRS):
            expected = (
                prediction.geometry.p_I1I2_I1[index]
                if (i, j) in unseen
                else relative_position_C(now[i], now[j])
            )
            np.testing.assert_allclose(found.geometry.p_I1I2_I1[index], expected, atol=1e-12)


def flown_over(team: tuple[TrueVehicle, ...]) -> tuple[TrueVehicle, ...]:
    """follower_1 straight above the leader."""
    return (
        team[0],
        dataclasses.replace(team[1], p_NB_N=team[0].p_NB_N + np.array([0.02, 0.0, 1.3])),
        team[2],
    )


def test_a_vertical_baseline_counts_as_not_seen() -> None:
    team = random_team(np.random.default_rng(8), 3)
    raw = Raw()
    before = raw.update(measure(team, NAMES))
    now = raw.update(measure(flown_over(team), NAMES, 1), make_prediction())
    assert now.yaw_held == tuple({i, j} == {0, 1} for i, j in PAIRS)
    for pair, held in enumerate(now.yaw_held):
        assert (now.yaw_variances[pair] > before.yaw_variances[pair]) or not held
        assert now.yaw_variances[pair] < YAW_STD_MAX**2
    # The position is used, even if it does not determine the yaw.
    np.testing.assert_allclose(
        now.geometry.p_I1I2_I1[0], team[0].levelled.inv().apply([0.02, 0.0, 1.3]), atol=1e-12
    )
    again = raw.update(measure(team, NAMES, 2), make_prediction())
    assert not any(again.yaw_held)


def test_a_vertical_baseline_at_the_start_is_waited_for() -> None:
    team = random_team(np.random.default_rng(9), 3)
    raw = Raw()
    assert raw.missing(measure(flown_over(team), NAMES)) == (
        "relative yaw of leader and follower_1 "
        "(both must see each other in one step, and not from straight above)"
    )
    assert_same(raw.update(measure(team, NAMES, 1)), Raw().update(measure(team, NAMES, 1)))


@pytest.mark.parametrize(
    ("vehicle", "lost", "missing"),
    [
        ("follower_1", "imu", "imu of follower_1"),
        ("follower_2", "optic_flow", "optic flow of follower_2"),
        ("leader", "localization", "localization of the leader"),
        (
            "follower_2",
            "range_bearing",
            "range and bearing from follower_2 to leader, range and bearing from follower_2 to follower_1",
        ),
    ],
)
def test_what_is_missing_at_the_start_is_waited_for(vehicle: str, lost: str, missing: str) -> None:
    team = random_team(np.random.default_rng(10), 3)
    raw = Raw()
    for step in range(3):
        reason = raw.missing(without(measure(team, NAMES, step), vehicle, **{lost: None}))
        assert reason.startswith(missing)
    assert_same(raw.update(measure(team, NAMES, 3)), Raw().update(measure(team, NAMES, 3)))


def test_many_missing_measurements_are_counted() -> None:
    measurements = measure(random_team(np.random.default_rng(10), 3), NAMES)
    for name in NAMES:
        measurements = without(measurements, name, imu=None, optic_flow=None)
    assert Raw().missing(measurements) == (
        "imu of leader, optic flow of leader, imu of follower_1 and 3 more"
    )


def test_before_the_start_the_newest_measurement_stands_in_for_a_lost_one() -> None:
    """The vehicles hover until then, so each sensor has to arrive once only."""
    team = random_team(np.random.default_rng(11), 3, rate_max=0.0)
    raw = Raw()
    raw.missing(without(measure(team, NAMES), "follower_1", optic_flow=None))
    now = without(measure(team, NAMES, 1), "leader", localization=None)
    found = raw.update(blinded(now, "follower_2", "leader"))
    assert_same(found, Raw().update(measure(team, NAMES)))
    np.testing.assert_array_equal(found.geometry.p_NI_N, team[0].p_NB_N)
    assert found.report.mode is EstimatorMode.PREDICTED
    assert found.report.reason == "range and bearing from follower_2 to leader, localization of the leader"
    assert found.yaw_held == tuple({i, j} == {0, 2} for i, j in PAIRS)
