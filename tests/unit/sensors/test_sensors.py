"""IMU, optic flow, sonar and localization: errors, offsets and limits of the messages."""

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from relform_core.events_config import LocalizationJump
from relform_core.load import load_scenario
from relform_core.measurements import Odometry
from relform_sensors.imu import UNKNOWN_YAW_VARIANCE, ImuSensor
from relform_sensors.localization import LocalizationSensor
from relform_sensors.optic_flow import OpticFlowSensor
from relform_sensors.sonar import SonarSensor

SENSORS = load_scenario(Path(__file__).parents[3] / "config/scenarios/paper.yaml").config.sensors
SAMPLES = 4000
ATTITUDE = Rotation.from_euler("ZYX", [2.5, 0.5, -0.7])
F_NB_B = np.array([0.3, -0.5, 9.2])


def truth_at(time: float = 2.0, height: float = 2.3) -> Odometry:
    return Odometry(
        stamp_ns=round(time * 1e9),
        p_NB_N=np.array([4.0, -3.0, height]),
        q_NB=ATTITUDE.as_quat(),
        v_NB_B=np.array([1.5, -0.4, 0.2]),
        w_NB_B=np.array([0.5, -0.8, 1.1]),
        pose_covariance=np.zeros((6, 6)),
        twist_covariance=np.zeros((6, 6)),
    )


def make_imu(seed: int = 0, *, yaw_is_known: bool = False, **changes: float) -> ImuSensor:
    config = SENSORS.imu.model_copy(update=changes)
    return ImuSensor(config, np.random.default_rng(seed), yaw_is_known=yaw_is_known)


def sample(read: Callable[[], Any]) -> Any:
    return np.array([read() for _ in range(SAMPLES)])


def assert_white(errors: Any, std: float) -> None:
    """Zero mean, the given standard deviation, and no correlation between the axes."""
    n = len(errors)
    assert np.abs(errors.mean(axis=0)).max() < 4.5 * std / math.sqrt(n)
    assert errors.std(axis=0) == pytest.approx(np.full(errors.shape[1], std), rel=0.05)
    assert np.abs(np.corrcoef(errors.T) - np.eye(errors.shape[1])).max() < 0.07


def test_imu_noise() -> None:
    imu, truth = make_imu(yaw_is_known=True), truth_at()
    readings = [imu.read(truth, F_NB_B) for _ in range(SAMPLES)]
    attitude_errors = (ATTITUDE.inv() * Rotation.from_quat([r.q_NB for r in readings])).as_rotvec()
    assert_white(attitude_errors, math.radians(0.005))
    assert_white(np.array([r.w_NB_B for r in readings]) - truth.w_NB_B, math.radians(3.0))
    assert_white(np.array([r.f_NB_B for r in readings]) - F_NB_B, 0.05)
    assert readings[0].stamp_ns == truth.stamp_ns
    assert readings[0].attitude_covariance == pytest.approx(math.radians(0.005) ** 2 * np.eye(3))
    assert readings[0].gyro_covariance == pytest.approx(math.radians(3.0) ** 2 * np.eye(3))
    assert readings[0].accelerometer_covariance == pytest.approx(0.05**2 * np.eye(3))


@pytest.mark.parametrize("time", [0.0, 1.0, 25.0])
def test_follower_yaw_is_off_by_a_constant_and_drifts_but_roll_and_pitch_are_true(time: float) -> None:
    imu = make_imu(seed=11, attitude_std=0.0)
    reading = imu.read(truth_at(time), F_NB_B)
    measured = Rotation.from_quat(reading.q_NB)
    expected = imu.yaw_offset + imu.yaw_drift_rate * time
    assert abs(imu.yaw_offset) > 0.1
    assert abs(imu.yaw_drift_rate) > math.radians(0.02)
    assert (measured * ATTITUDE.inv()).as_matrix() == pytest.approx(
        Rotation.from_euler("z", expected).as_matrix(), abs=1e-12
    )
    assert measured.as_euler("ZYX")[1:] == pytest.approx([0.5, -0.7])
    assert reading.attitude_covariance[2, 2] == UNKNOWN_YAW_VARIANCE > 3.0


def test_yaw_offsets_are_uniform_and_drifts_as_specified() -> None:
    imus = [make_imu(seed) for seed in range(1000)]
    offsets = np.sort([imu.yaw_offset for imu in imus])
    assert (
        np.abs(offsets - np.linspace(-math.pi, math.pi, 1000)).max() < 0.06 * math.tau
    )  # Kolmogorov-Smirnov
    assert np.std([imu.yaw_drift_rate for imu in imus]) == pytest.approx(math.radians(0.2), rel=0.08)


def test_leader_yaw_is_exact_and_uses_the_same_draws() -> None:
    leader, follower = make_imu(3, yaw_is_known=True), make_imu(3)
    assert (leader.yaw_offset, leader.yaw_drift_rate) == (0.0, 0.0)
    a, b = leader.read(truth_at(), F_NB_B), follower.read(truth_at(), F_NB_B)
    assert a.w_NB_B.tolist() == b.w_NB_B.tolist()
    assert a.f_NB_B.tolist() == b.f_NB_B.tolist()


def test_optic_flow_noise() -> None:
    sensor, truth = OpticFlowSensor(SENSORS.optic_flow, np.random.default_rng(1)), truth_at()
    assert_white(sample(lambda: sensor.read(truth).v_NB_B) - truth.v_NB_B, 0.25)
    assert sensor.read(truth).covariance == pytest.approx(0.25**2 * np.eye(3))


def make_sonar(**changes: float) -> SonarSensor:
    return SonarSensor(SENSORS.sonar.model_copy(update=changes), np.random.default_rng(2))


def test_sonar_measures_height_at_any_attitude() -> None:
    sensor = make_sonar()
    errors = sample(lambda: [sensor.read(truth_at(height=2.3)).range]) - 2.3
    assert abs(errors.mean()) < 4.5 * 0.02 / math.sqrt(SAMPLES)
    assert errors.std() == pytest.approx(0.02, rel=0.05)


@pytest.mark.parametrize(("height", "expected"), [(0.1, -math.inf), (-0.2, -math.inf), (10.5, math.inf)])
def test_sonar_beyond_its_limits_is_infinite_with_the_sign_of_the_side(
    height: float, expected: float
) -> None:
    reading = make_sonar().read(truth_at(height=height))
    assert reading.range == expected
    assert math.isfinite(reading.range_min)
    assert math.isfinite(reading.range_max)


def test_sonar_values_fit_the_message_exactly() -> None:
    reading = make_sonar(range_std=0.01).read(truth_at(height=1.2345678))
    for value in (reading.range, reading.range_min, reading.range_max, reading.field_of_view):
        assert value == float(np.float32(value))
    assert reading.range_max == 10.0
    assert reading.field_of_view == pytest.approx(math.radians(30.0))


def test_sonar_exactly_at_its_limit_is_within() -> None:
    # 0.2 is not a float32: limit and range must be rounded alike.
    assert make_sonar(range_std=0.0).read(truth_at(height=0.2)).range == pytest.approx(0.2)


def test_localization_jumps_while_the_event_lasts() -> None:
    jump = LocalizationJump(
        kind="localization_jump", target="leader", start_s=1.0, end_s=2.0, offset_m=(0.3, -0.4, 0.1)
    )
    for time, expected in ((0.95, 0.0), (1.0, 1.0), (1.95, 1.0), (2.0, 0.0)):
        truth = truth_at(time)
        calm, off = (
            LocalizationSensor(SENSORS.localization, np.random.default_rng(4), jumps).read(truth)
            for jumps in ((), (jump,))
        )
        np.testing.assert_allclose(off.p_NB_N - calm.p_NB_N, expected * np.array(jump.offset_N), atol=1e-12)
        np.testing.assert_array_equal(off.q_NB, calm.q_NB)


def test_localization_noise() -> None:
    sensor, truth = LocalizationSensor(SENSORS.localization, np.random.default_rng(4)), truth_at()
    readings = [sensor.read(truth) for _ in range(SAMPLES)]
    assert_white(np.array([r.p_NB_N for r in readings]) - truth.p_NB_N, 0.02)
    assert_white(np.array([r.v_NB_B for r in readings]) - truth.v_NB_B, 0.1)
    attitude_errors = (ATTITUDE.inv() * Rotation.from_quat([r.q_NB for r in readings])).as_rotvec()
    assert_white(attitude_errors, math.radians(0.005))
    assert np.diag(readings[0].pose_covariance) == pytest.approx(
        [0.02**2] * 3 + [math.radians(0.005) ** 2] * 3
    )
    assert np.diag(readings[0].twist_covariance)[:3] == pytest.approx([0.1**2] * 3)
    # It does not measure the rates, and must not leak them.
    assert not readings[0].w_NB_B.any()
    assert np.diag(readings[0].twist_covariance)[3:].min() > 1e3
