"""What the team filter is given of the measurements of one instant."""

import numpy as np
import pytest

from relform_controller.estimation.team_observation import ObservationBuilder
from relform_core.arrays import Array
from relform_core.sensors.range_bearing import RANGE_BEARING, RangeBearing, RangeBearings

PLAIN = np.diag([4e-4, 1e-2, 2e-3])
CORRELATED = PLAIN + 1e-4 * np.array([[0.0, 1.0, -2.0], [1.0, 0.0, 3.0], [-2.0, 3.0, 0.0]])


@pytest.mark.parametrize("second", [PLAIN, CORRELATED, 2.0 * PLAIN], ids=["same", "correlated", "larger"])
def test_weights_of_sightings_are_roots_of_their_inverse_covariances(second: Array) -> None:
    seen = RangeBearings(
        50_000_000,
        {
            "one": RangeBearing("one", 1.5, 0.4, -0.2, PLAIN),
            "two": RangeBearing("two", 2.5, -1.4, 0.3, second),
        },
    )
    builder = ObservationBuilder(("leader", "one", "two"), height_std=0.05)
    observation = builder.build({("leader", RANGE_BEARING.name): seen})
    np.testing.assert_array_equal(observation.sightings[:3], [[1.5, 0.4, -0.2], [2.5, -1.4, 0.3], [0, 0, 0]])
    for weights, covariance in zip(observation.sighting_weights, (PLAIN, second), strict=False):
        np.testing.assert_allclose(weights.T @ weights @ covariance, np.eye(3), atol=1e-5)
    assert not observation.sighting_weights[2:].any()
