"""Every registered sensor can be configured, mounted and read."""

from typing import Any

import numpy as np
import pytest

from relform_core.randomness import Streams
from relform_core.sensors.registry import SENSORS
from relform_core.sensors.sensor import Sensor
from relform_sensors.model import Carrier, Scene, mount
from support.logs import odometry
from support.scenarios import paper_scenario

CONFIG = paper_scenario().config
TRUTH = {
    name: odometry(50_000_000, (float(i), 0.5 * i, 2.0), 30.0) for i, name in enumerate(CONFIG.team.vehicles)
}


@pytest.mark.parametrize("sensor", CONFIG.sensors_of("leader"), ids=lambda sensor: sensor.name)
def test_a_mounted_sensor_reads_its_measurement(sensor: Sensor[Any, Any]) -> None:
    carrier = Carrier.of(CONFIG, "leader")
    read = mount(sensor, CONFIG.sensors.of(sensor), Streams(3, 0)[sensor.stream], carrier)
    measurement = read(Scene("leader", TRUTH, np.array([0.0, 0.0, 9.81])))
    assert isinstance(measurement, sensor.measurement)
    assert measurement.stamp_ns == TRUTH["leader"].stamp_ns


def test_followers_carry_every_configured_sensor_except_those_of_the_leader() -> None:
    configured = [sensor for sensor in SENSORS if CONFIG.sensors.has(sensor)]
    assert list(CONFIG.sensors_of("leader")) == configured
    assert list(CONFIG.sensors_of("follower_1")) == [each for each in configured if not each.leader_only]
