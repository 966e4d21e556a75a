"""When a vehicle evades another one on board, which way, and with which thrust."""

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from relform_core.load import load_scenario
from relform_core.sensors.imu import Imu
from relform_core.sensors.optic_flow import OpticFlow
from relform_core.sensors.range_bearing import RangeBearing
from relform_core.sensors.sonar import Sonar
from relform_core.separation_config import SeparationConfig
from relform_core.units import GRAVITY
from relform_sim.evasion import BRAKING, OUTLIERS_MAX, REACTION_S, SPEED, Evasion, rises
from relform_sim.pilot import Readings
from relform_sim.tilt_control import up_direction
from relform_sim.vertical_thrust import GAIN, VerticalThrust

VEHICLE = load_scenario(Path(__file__).parents[3] / "config/scenarios/paper.yaml").config.vehicle
PERIOD = 0.05
SEPARATION = SeparationConfig(warning_m=0.9, emergency_m=0.7)
STD = 0.025
HOVER = np.full(4, VEHICLE.hover_speed)


def sight(distance: float, azimuth: float = 0.3, elevation: float = 0.0) -> RangeBearing:
    return RangeBearing("other", distance, azimuth, elevation, np.diag([STD**2, 1e-3, 1e-3]))


def readings(
    *seen: RangeBearing, climb: float = 0.0, height: float = 2.0, first: bool = False, tilt: float = 0.0
) -> Readings:
    """Of a vehicle that sees others; ``first``: these come before it in team order."""
    q_NB = Rotation.from_euler("x", tilt)
    imu = Imu(0, q_NB.as_quat(), np.eye(3), np.zeros(3), np.eye(3), np.array([0, 0, GRAVITY]), np.eye(3))
    flow = OpticFlow(0, q_NB.inv().apply([0.4, 0.0, climb]), np.eye(3))
    neighbours = {each.target: each for each in seen}
    landmarks = neighbours if first else {}
    return Readings(imu, flow, Sonar(0, height, 0.2, 10.0, 0.5), landmarks, None, neighbours)


def flown(*ranges: float) -> Evasion:
    """After these ranges, one per period."""
    evasion = Evasion(PERIOD, SEPARATION)
    for distance in ranges:
        evasion.sense(readings(sight(distance)))
    return evasion


def thrust_and_torques(speeds: np.ndarray) -> tuple[float, np.ndarray]:
    thrusts = VEHICLE.thrust_coefficient * speeds**2
    return float(thrusts.sum()), thrusts - thrusts.mean()


def test_begins_below_the_emergency_and_ends_beyond_the_warning() -> None:
    assert flown(0.75, 0.75, 0.75).climb is None
    evasion = flown(0.69)
    assert evasion.climb is not None
    for distance in np.linspace(0.69, 0.87, 19):  # it comes apart slowly
        evasion.sense(readings(sight(distance)))
        assert evasion.climb is not None
    for distance in (0.89, 0.91, 0.93, 0.95):
        evasion.sense(readings(sight(distance)))
    assert evasion.climb is None


def test_begins_earlier_the_faster_the_other_one_comes() -> None:
    """At constant speed v: below emergency + v * reaction + v^2 / (2 * braking)."""
    for speed in (0.5, 1.0, 2.0):
        begin = SEPARATION.emergency + speed * REACTION_S + speed**2 / (2.0 * BRAKING)
        evasion = Evasion(PERIOD, SEPARATION)
        distance = begin + 1.0
        while evasion.climb is None:
            distance -= speed * PERIOD
            evasion.sense(readings(sight(distance)))
        assert begin - 1.5 * speed * PERIOD < distance < begin


def test_one_outlier_is_no_reason_and_a_run_of_them_is() -> None:
    evasion = flown(*[1.5] * 10)
    for _ in range(OUTLIERS_MAX):
        evasion.sense(readings(sight(0.3)))
        assert evasion.climb is None
    evasion.sense(readings(sight(0.3)))
    assert evasion.climb is not None


def test_a_neighbour_out_of_view_is_forgotten() -> None:
    evasion = flown(0.6)
    for _ in range(5):
        evasion.sense(readings())
        assert evasion.climb is not None
    evasion.sense(readings())
    assert evasion.climb is None


@given(
    elevation=st.floats(-1.2, 1.2),
    azimuth=st.floats(-3.1, 3.1),
    tilts=st.tuples(*[st.floats(-0.6, 0.6)] * 4),
    yaw=st.floats(-3.1, 3.1),
)
def test_of_two_vehicles_one_rises_and_the_other_sinks(
    elevation: float, azimuth: float, tilts: tuple[float, float, float, float], yaw: float
) -> None:
    attitudes = [
        Rotation.from_euler("ZYX", [turn, *tilt]) for turn, tilt in ((0.0, tilts[:2]), (yaw, tilts[2:]))
    ]
    level = math.cos(elevation)
    line_N = np.array([level * math.cos(azimuth), level * math.sin(azimuth), math.sin(elevation)])
    answers = []
    for attitude, towards_N, is_first in zip(attitudes, (line_N, -line_N), (True, False), strict=True):
        x, y, z = attitude.inv().apply(towards_N)
        seen = sight(0.7, math.atan2(y, x), math.asin(max(-1.0, min(1.0, z))))
        answers.append(rises(seen, up_direction(attitude.as_quat()), is_first=is_first))
    if abs(math.sin(elevation) - 0.2) > 1e-6:  # where the rule changes, rounding decides
        assert answers[0] is not answers[1]
        assert answers[0] is (math.sin(elevation) < 0.2)


def test_which_way_by_the_order_of_the_team() -> None:
    for first, climb in ((False, SPEED), (True, -SPEED)):
        evasion = Evasion(PERIOD, SEPARATION)
        evasion.sense(readings(sight(0.6), first=first))
        assert evasion.climb == climb


def test_the_thrust_is_that_of_the_climb_and_the_torques_stay() -> None:
    planned = HOVER + np.array([12.0, -7.0, 3.0, -9.0])
    seen = readings(climb=1.1, tilt=0.3)
    thrust, torques = thrust_and_torques(VerticalThrust(VEHICLE).rotor_speeds(planned, seen, 1.4))
    assert thrust == pytest.approx(VEHICLE.mass * (GRAVITY + GAIN * 0.3) / math.cos(0.3))
    np.testing.assert_allclose(torques, thrust_and_torques(planned)[1], atol=1e-12)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_torques_come_before_thrust_at_the_limits(sign: float) -> None:
    planned = HOVER + np.array([30.0, 0.0, -30.0, 0.0])
    speeds = VerticalThrust(VEHICLE).rotor_speeds(planned, readings(climb=-sign), sign * SPEED)
    assert speeds.min() >= VEHICLE.rotor_speed_min - 1e-9
    assert speeds.max() <= VEHICLE.rotor_speed_max + 1e-9
    thrust, torques = thrust_and_torques(speeds)
    np.testing.assert_allclose(torques, thrust_and_torques(planned)[1], atol=1e-12)
    assert sign * (thrust - VEHICLE.mass * GRAVITY) > 0.6 * VEHICLE.mass * GRAVITY


def test_a_vehicle_near_the_ground_does_not_sink() -> None:
    evasion = Evasion(PERIOD, SEPARATION)
    for height in (0.5, -math.inf):
        evasion.sense(readings(sight(0.6), height=height, first=True))
        assert evasion.climb == 0.0
