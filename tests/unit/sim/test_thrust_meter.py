"""A vehicle measures its thrust, and notices when it is too weak to fly on."""

import math

import numpy as np
import pytest

from relform_core.sensors.imu import Imu
from relform_core.sensors.optic_flow import OpticFlow
from relform_core.sensors.sonar import Sonar
from relform_core.units import GRAVITY
from relform_sim.pilot import Readings
from relform_sim.thrust_meter import ThrustMeter
from support.scenarios import paper_scenario

VEHICLE = paper_scenario().config.vehicle
PERIOD = 0.05
FASTER = np.full(4, math.sqrt(1.25) * VEHICLE.hover_speed)
"""Rotor speeds at which 80 % of the thrust carry the weight."""


def readings(specific_force: float = GRAVITY, height: float = 2.0) -> Readings:
    imu = Imu(
        0,
        np.array([0.0, 0.0, 0.0, 1.0]),
        np.eye(3),
        np.zeros(3),
        np.eye(3),
        np.array([0.4, -0.2, specific_force]),
        np.eye(3),
    )
    return Readings(imu, OpticFlow(0, np.zeros(3), np.eye(3)), Sonar(0, height, 0.2, 10.0, 0.5))


def test_it_finds_the_share_of_the_thrust() -> None:
    meter = ThrustMeter(VEHICLE, PERIOD, least=0.7)
    meter.sense(readings(), FASTER)
    assert meter.share == pytest.approx(1.0 - 0.2 * 0.05 / 1.05)
    for _ in range(200):
        meter.sense(readings(), FASTER)
    assert meter.share == pytest.approx(0.8, abs=1e-3)
    assert not meter.is_weak


def test_it_is_weak_after_two_seconds_until_it_stands_on_the_ground() -> None:
    meter = ThrustMeter(VEHICLE, PERIOD, least=0.7)
    for _ in range(200):
        meter.sense(readings(0.65 * 1.25 * GRAVITY), FASTER)
        if meter.share < 0.7:
            break
    for _ in range(38):
        meter.sense(readings(0.65 * 1.25 * GRAVITY), FASTER)
        assert not meter.is_weak
    for _ in range(2):
        meter.sense(readings(0.65 * 1.25 * GRAVITY), FASTER)
    assert meter.is_weak
    for _ in range(100):
        meter.sense(readings(1.25 * GRAVITY), FASTER)
    assert meter.is_weak
    meter.reset()
    assert (meter.is_weak, meter.share) == (False, 1.0)


def test_a_gust_from_above_is_no_weakness_and_the_ground_is_no_thrust() -> None:
    """A second of a push by 40 % of the weight; legs that carry the vehicle while its motors idle."""
    meter = ThrustMeter(VEHICLE, PERIOD, least=0.7)
    hover = np.full(4, VEHICLE.hover_speed)
    for step in range(100):
        meter.sense(readings(0.6 * GRAVITY if step < 20 else GRAVITY), hover)
        assert not meter.is_weak
    for _ in range(100):
        meter.sense(readings(height=0.1), 0.5 * hover)
        meter.sense(readings(height=-math.inf), np.zeros(4))
    assert meter.share == pytest.approx(1.0, abs=0.01)
