"""A vehicle keeps below the geofence by its own sonar, and sinks faster the higher it is."""

import math

import numpy as np
import pytest

from relform_core.geofence_config import GeofenceConfig
from relform_core.sensors.imu import Imu
from relform_core.sensors.optic_flow import OpticFlow
from relform_core.sensors.sonar import Sonar
from relform_sim.ceiling import Ceiling
from relform_sim.pilot import Readings

FENCE = GeofenceConfig(x_m=(-5.0, 5.0), y_m=(-5.0, 5.0), height_max_m=4.0)


def readings(height: float, climb: float = 0.0) -> Readings:
    imu = Imu(0, np.array([0.0, 0.0, 0.0, 1.0]), np.eye(3), np.zeros(3), np.eye(3), np.zeros(3), np.eye(3))
    flow = OpticFlow(0, np.array([0.7, -0.4, climb]), np.eye(3))
    return Readings(imu, flow, Sonar(0, height, 0.2, 10.0, 0.5))


@pytest.mark.parametrize(("height", "climb"), [(4.1, -0.1), (4.5, -0.5), (7.0, -1.0), (math.inf, -1.0)])
def test_two_readings_in_a_row_send_it_down(height: float, climb: float) -> None:
    ceiling = Ceiling(FENCE)
    for seen in (3.0, height, 3.9, height):
        ceiling.sense(readings(seen))
        assert ceiling.climb is None
    ceiling.sense(readings(height))
    assert ceiling.climb == pytest.approx(climb)
    ceiling.sense(readings(3.99))
    assert ceiling.climb is None


def test_a_climb_ends_in_time() -> None:
    """At 2.4 m/s it still rises by 2.4 * 0.1 + 2.4^2 / 12 = 0.72 m."""
    for height, ends in ((3.27, False), (3.29, True)):
        ceiling = Ceiling(FENCE)
        for _ in range(2):
            ceiling.sense(readings(height, climb=2.4))
        assert (ceiling.climb == 0.0) is ends
