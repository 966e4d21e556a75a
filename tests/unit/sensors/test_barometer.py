"""Barometer: pressure of the standard atmosphere, noise, an offset that drifts."""

import re

import numpy as np
import pytest

from relform_core.errors import ConfigError
from relform_core.measurements import Odometry
from relform_core.randomness import Streams
from relform_core.sensors.barometer import BAROMETER
from relform_sensors.barometer import BarometerSensor, standard_pressure
from relform_sensors.suite import SensorSuite
from support.logs import odometry
from support.scenarios import WITH_BAROMETER, paper_scenario

SCENARIO = paper_scenario(WITH_BAROMETER)
CONFIG = SCENARIO.config.sensors.of(BAROMETER)


def truth_at(time: float, height: float) -> Odometry:
    return odometry(round(time * 1e9), (4.0, -3.0, height), yaw_deg=40.0)


def make_barometer(seed: int, **changes: float) -> BarometerSensor:
    return BarometerSensor(CONFIG.model_copy(update=changes), np.random.default_rng(seed))


def test_pressure_at_sea_level_and_its_fall_with_the_first_metre() -> None:
    assert standard_pressure(0.0) == 101_325.0
    # Hydrostatics: density times gravity per metre.
    assert standard_pressure(0.0) - standard_pressure(1.0) == pytest.approx(1.225 * 9.80665, rel=1e-4)


def test_noise_is_white_and_its_variance_is_in_the_measurement() -> None:
    sensor, truth = make_barometer(5, bias_std=0.0, drift_std=0.0), truth_at(2.0, 2.5)
    readings = [sensor.read(truth) for _ in range(4000)]
    errors = np.array([reading.pressure for reading in readings]) - standard_pressure(2.5)
    assert abs(errors.mean()) < 4.5 * 6.0 / np.sqrt(len(errors))
    assert errors.std() == pytest.approx(6.0, rel=0.05)
    assert abs(np.corrcoef(errors[1:], errors[:-1])[0, 1]) < 0.07
    assert readings[0].variance == 36.0
    assert readings[0].stamp_ns == 2_000_000_000


def test_offset_is_constant_and_drifts_at_a_constant_rate() -> None:
    sensor = make_barometer(6, pressure_std=1e-9)
    errors = [sensor.read(truth_at(t, 3.0)).pressure - standard_pressure(3.0) for t in (0.0, 10.0, 30.0)]
    assert errors == pytest.approx([sensor.bias + sensor.drift_rate * t for t in (0.0, 10.0, 30.0)], abs=1e-6)
    assert errors[0] != errors[1]


def test_offsets_and_drifts_are_spread_over_flights_as_configured() -> None:
    sensors = [make_barometer(seed) for seed in range(2000)]
    assert np.std([sensor.bias for sensor in sensors]) == pytest.approx(50.0, rel=0.06)
    assert np.std([sensor.drift_rate for sensor in sensors]) == pytest.approx(0.1, rel=0.06)


def test_the_papers_sensors_have_no_barometer() -> None:
    config = paper_scenario().config
    assert not config.sensors.has(BAROMETER)
    assert BAROMETER not in config.sensors_of("leader")
    with pytest.raises(LookupError, match=re.escape("sensors.barometer is not configured")):
        config.sensors.of(BAROMETER)


def test_the_section_is_written_into_the_effective_configuration() -> None:
    assert "barometer" in SCENARIO.effective_yaml
    assert "barometer" not in paper_scenario().effective_yaml


@pytest.mark.parametrize("vehicle", SCENARIO.config.team.vehicles)
def test_every_vehicle_carries_a_configured_barometer(vehicle: str) -> None:
    suite = SensorSuite(SCENARIO.config, vehicle, Streams(3, 1))
    truth = {name: truth_at(0.05, 2.0) for name in SCENARIO.config.team.vehicles}
    pressure = suite.read(truth, np.zeros(3)).newest(BAROMETER)
    assert pressure is not None
    assert pressure.pressure == pytest.approx(standard_pressure(2.0), abs=300.0)


@pytest.mark.parametrize(
    ("overrides", "problem"),
    [
        (
            (WITH_BAROMETER, "sensors.barometer.pressure_std_pa=0"),
            "pressure_std_pa: must be greater than 0 (got 0)",
        ),
        (
            (WITH_BAROMETER, "sensors.barometer.bias_std_pa=-1"),
            "bias_std_pa: must be greater than or equal to 0",
        ),
        (
            (WITH_BAROMETER, "sensors.barometer.bias=1"),
            "sensors.barometer.bias: unknown key (did you mean 'bias_std_pa'?)",
        ),
        (("sensors.barometer={}",), "sensors.barometer.pressure_std_pa: missing key"),
        (
            (
                "events=[{kind: dropout, start_s: 1, end_s: 2, target: leader, sensor: barometer, "
                "probability: 0.5}]",
            ),
            "event 'dropout': 'leader' has no barometer, sensors.barometer is not configured",
        ),
    ],
)
def test_bad_configurations(overrides: tuple[str, ...], problem: str) -> None:
    with pytest.raises(ConfigError, match=re.escape(problem)):
        paper_scenario(*overrides)
