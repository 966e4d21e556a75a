"""Relative yaw from mutual sight: numbers worked out by hand, its variance, and its singular case."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from relform_controller.estimation.relative_yaw import (
    YawEstimate,
    propagate,
    relative_position_B,
    relative_position_covariance_B,
    yaw_from_mutual_sight,
)
from relform_controller.ocp.frames import rotation_CB
from relform_core.sensors.range_bearing import RangeBearing
from support.world import POSITION_STD, TrueVehicle, random_team, sight

DEGREE = math.pi / 180.0
LEVEL = np.eye(3)


def seen(distance: float, azimuth_deg: float, elevation_deg: float) -> RangeBearing:
    return RangeBearing("other", distance, azimuth_deg * DEGREE, elevation_deg * DEGREE, 1e-4 * np.eye(3))


def test_range_and_bearing_to_position() -> None:
    # 2 m, 60 deg to the left, 30 deg up: horizontal sqrt(3), of which cos 60 forward and sin 60 left
    expected = [math.sqrt(3) / 2, 1.5, 1.0]
    np.testing.assert_allclose(relative_position_B(seen(2.0, 60.0, 30.0)), expected, atol=1e-15)


def test_equal_yaws_see_each_other_in_opposite_directions() -> None:
    estimate = yaw_from_mutual_sight(seen(2.0, 30.0, 10.0), LEVEL, seen(2.0, -150.0, -10.0), LEVEL)
    assert estimate.yaw == pytest.approx(0.0, abs=1e-15)


def test_sign_is_that_of_the_second_vehicle_relative_to_the_first() -> None:
    """Both look east, 1 sees 2 straight ahead and 2 sees 1 straight behind; then 2 turns left by 40 deg.

    What was behind 2 is now seen 40 deg further to its right: at 180 - 40 = 140 deg.
    """
    estimate = yaw_from_mutual_sight(seen(2.0, 0.0, 0.0), LEVEL, seen(2.0, 140.0, 0.0), LEVEL)
    assert estimate.yaw == pytest.approx(40.0 * DEGREE)
    v_I1 = Rotation.from_euler("z", estimate.yaw).apply([1.0, 0.0, 0.0])  # where 2 looks, seen from 1
    assert v_I1[1] > 0  # to the left


def test_roll_and_pitch_are_levelled_out() -> None:
    """1 is rolled by 90 deg, its left up and its top to the right: what it sees on top is at its right."""
    estimate = yaw_from_mutual_sight(
        seen(2.0, 0.0, 90.0), rotation_CB(math.pi / 2, 0.0), seen(2.0, 90.0, 0.0), LEVEL
    )
    # 2 is level and sees 1 at its left: both look in the same direction.
    assert estimate.yaw == pytest.approx(0.0, abs=1e-12)


def test_variance_by_hand() -> None:
    """Level and at one height: only the azimuths matter, and their variances add up."""
    first = RangeBearing("b", 2.0, 0.4, 0.0, np.diag([9.0, 0.01, 4.0]))
    second = RangeBearing("a", 2.0, 2.9, 0.0, np.diag([9.0, 0.03, 4.0]))
    assert yaw_from_mutual_sight(first, LEVEL, second, LEVEL).variance == pytest.approx(0.04)


@pytest.mark.parametrize("seed", [1, 2, 3, 4])
def test_variance_is_that_of_the_sensor_noise(seed: int) -> None:
    """Range noise 0.025 m, elevation 0.025 / r, azimuth 0.025 / (r cos elevation), on tilted vehicles."""
    generator = np.random.default_rng(seed)
    first, second = random_team(generator, 2, tilt_max=0.6)
    R_C1B1 = (first.levelled.inv() * first.attitude).as_matrix()
    R_C2B2 = (second.levelled.inv() * second.attitude).as_matrix()
    exact = yaw_from_mutual_sight(sight(first, second, "b"), R_C1B1, sight(second, first, "a"), R_C2B2)
    errors = [
        yaw_from_mutual_sight(
            sight(first, second, "b", generator.standard_normal(3)),
            R_C1B1,
            sight(second, first, "a", generator.standard_normal(3)),
            R_C2B2,
        ).yaw
        - exact.yaw
        for _ in range(4000)
    ]
    errors = (np.array(errors) + np.pi) % (2 * np.pi) - np.pi
    assert np.var(errors) == pytest.approx(exact.variance, rel=0.15)
    assert abs(np.mean(errors)) < 4 * math.sqrt(exact.variance / 4000)


def test_variance_of_a_sensor_that_is_good_in_one_direction_only() -> None:
    """Steep sight from tilted vehicles: each error of each sensor turns the heading in its own way."""
    generator = np.random.default_rng(12)
    std = np.array([0.3, 0.002, 0.02])  # of range, azimuth and elevation
    first = TrueVehicle(np.zeros(3), Rotation.from_euler("ZYX", [0.4, 0.6, -0.5]), np.zeros(3), np.zeros(3))
    second = TrueVehicle(
        np.array([1.5, -2.0, 2.5]), Rotation.from_euler("ZYX", [-2.0, -0.7, 0.8]), np.zeros(3), np.zeros(3)
    )
    R_C1B1, R_C2B2 = rotation_CB(-0.5, 0.6), rotation_CB(0.8, -0.7)

    def measured(observer: TrueVehicle, target: TrueVehicle, draw: np.ndarray) -> RangeBearing:
        true = sight(observer, target, "other")
        errors = std * draw
        return RangeBearing(
            "other",
            true.range + errors[0],
            true.azimuth + errors[1],
            true.elevation + errors[2],
            np.diag(std**2),
        )

    estimates = [
        yaw_from_mutual_sight(
            measured(first, second, generator.standard_normal(3)),
            R_C1B1,
            measured(second, first, generator.standard_normal(3)),
            R_C2B2,
        )
        for _ in range(4000)
    ]
    zero = np.zeros(3)
    exact = yaw_from_mutual_sight(
        measured(first, second, zero), R_C1B1, measured(second, first, zero), R_C2B2
    )
    assert np.var([estimate.yaw for estimate in estimates]) == pytest.approx(exact.variance, rel=0.15)


def test_covariance_of_the_position_is_a_ball_for_small_noise() -> None:
    """The sensor is as good across the line of sight as along it, whatever the bearing."""
    bearing = sight(*random_team(np.random.default_rng(8), 2, tilt_max=0.7), "b")
    covariance = relative_position_covariance_B(bearing)
    np.testing.assert_allclose(covariance, POSITION_STD**2 * np.eye(3), atol=1e-12)


def test_variance_grows_as_one_vehicle_flies_over_the_other() -> None:
    lower = TrueVehicle(np.zeros(3), Rotation.from_euler("ZYX", [0.3, 0.1, -0.2]), np.zeros(3), np.zeros(3))
    variances = []
    for horizontal in (1.0, 0.3, 0.1, 0.01):
        upper = TrueVehicle(
            np.array([horizontal * 0.6, horizontal * 0.8, 1.0]),
            Rotation.from_euler("ZYX", [2.0, -0.2, 0.1]),
            np.zeros(3),
            np.zeros(3),
        )
        estimate = yaw_from_mutual_sight(
            sight(lower, upper, "b"), rotation_CB(-0.2, 0.1), sight(upper, lower, "a"), rotation_CB(0.1, -0.2)
        )
        assert estimate.yaw == pytest.approx(1.7)
        variances.append(estimate.variance)
    # Two bearings, each with the ball of the position seen over the horizontal baseline.
    np.testing.assert_allclose(
        variances, [2 * (POSITION_STD / h) ** 2 for h in (1.0, 0.3, 0.1, 0.01)], rtol=1e-6
    )


def test_variance_is_infinite_from_straight_above() -> None:
    estimate = yaw_from_mutual_sight(seen(2.0, 12.0, 90.0), LEVEL, seen(2.0, 50.0, -90.0), LEVEL)
    assert estimate.variance == math.inf


def test_a_held_yaw_is_propagated_with_the_yaw_rates() -> None:
    held = propagate(YawEstimate(3.0, 0.01), rate_1=-1.0, rate_2=3.0, rate_variance=0.5, period=0.1)
    assert held.yaw == pytest.approx(3.0 + 0.4 - 2 * math.pi)
    assert held.variance == pytest.approx(0.015)
