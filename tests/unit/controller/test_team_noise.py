"""Process noise of the team filter over time."""

import numpy as np

from relform_controller.estimation.team_noise import PERIOD, ProcessNoise
from relform_controller.ocp.scaling import HUMMINGBIRD


def test_the_noise_of_some_time_does_not_depend_on_the_control_rate() -> None:
    thrusts = np.array([[1.7, 2.1, 1.5, 1.9], [2.2, 1.6, 1.8, 2.0]])
    at_20_hz = ProcessNoise().variances(thrusts, 0.05, HUMMINGBIRD)
    at_100_hz = ProcessNoise().variances(thrusts, 0.01, HUMMINGBIRD)
    np.testing.assert_allclose(5.0 * at_100_hz, at_20_hz, rtol=1e-12)


def test_deviations_are_those_of_the_period() -> None:
    variances = ProcessNoise(velocity=2e-4, rate=3e-4, inertia=0.0).variances(
        np.array([[1.7, 2.1, 1.5, 1.9]]), PERIOD, HUMMINGBIRD
    )
    np.testing.assert_allclose(variances[0, 3:6], 4e-8)
    np.testing.assert_allclose(np.sqrt(variances[0, 9:12]), 3e-4)
