"""Losses and limits of view change no other draw: flights with the same seed stay comparable."""

from collections.abc import Mapping
from dataclasses import fields
from typing import Any

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from relform_core.events_config import Dropout, Outliers
from relform_core.measurements import Odometry, VehicleMeasurements
from relform_core.randomness import Streams
from relform_core.scenario_config import ScenarioConfig
from relform_core.sensors.imu import IMU
from relform_core.sensors.localization import LOCALIZATION
from relform_core.sensors.range_bearing import RANGE_BEARING
from relform_sensors.suite import SensorSuite
from relform_sim.link import radio_link
from support.scenarios import WITH_BAROMETER, paper_scenario

PAPER = paper_scenario().config
CONFIG = paper_scenario(WITH_BAROMETER).config
SENSORS = tuple(sensor.name for sensor in CONFIG.sensors_of("leader"))
N_STEPS = 6
OUT_OF_VIEW = np.array([500.0, 0.0, 0.0])
ZEROS = np.zeros((6, 6))

sensor_sets = st.sets(st.sampled_from(SENSORS))
step_sets = st.sets(st.integers(0, N_STEPS - 1))
probabilities = st.floats(0.0, 1.0)


def ground_truth(step: int, hidden: Mapping[str, set[int]]) -> dict[str, Odometry]:
    """A flying, tilted team; a hidden vehicle is far away at these steps."""
    truth = {}
    for index, name in enumerate(CONFIG.team.vehicles):
        position = np.array([-1.0 * index, 0.3 * index + 0.1 * step, 2.0 - 0.3 * index])
        if step in hidden.get(name, ()):
            position = position + OUT_OF_VIEW
        q_NB = Rotation.from_euler("ZYX", [0.3 * step, 0.2 - 0.1 * index, 0.1 * step]).as_quat()
        velocity, rates = np.array([1.0, 0.2 * index, -0.1 * step]), np.array([0.1 * step, -0.2, 0.3 * index])
        truth[name] = Odometry(step * CONFIG.period_ns, position, q_NB, velocity, rates, ZEROS, ZEROS)
    return truth


def fly(
    config: ScenarioConfig, name: str, seed: int, hidden: Mapping[str, set[int]] | None = None
) -> list[VehicleMeasurements]:
    streams = Streams(seed, config.team.vehicles.index(name))
    suite, link = SensorSuite(config, name, streams), radio_link(config, name, streams)
    f_NB_B = np.array([0.1, -0.2, 9.7])
    arrived = []
    for step in range(N_STEPS):
        readings = suite.read(ground_truth(step, hidden or {}), f_NB_B)
        for sensor in config.sensors_of(name):
            link.up.send(step * config.period_ns, (sensor, readings.newest(sensor)))
        arrived.append(VehicleMeasurements.collect(link.up.deliver(step * config.period_ns)))
    return arrived


def bits(value: Any) -> Any:
    """Everything that a message holds, to compare bit for bit."""
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, list | tuple):
        return [bits(item) for item in value]
    if isinstance(value, Mapping):
        return {key: bits(item) for key, item in value.items()}
    if hasattr(value, "__dataclass_fields__"):
        return {field.name: bits(getattr(value, field.name)) for field in fields(value)}
    return value


def dropout(sensor: str, start: float, probability: float, target: str) -> Dropout:
    return Dropout.model_validate(
        {
            "kind": "dropout",
            "sensor": sensor,
            "start_s": start,
            "end_s": 10.0,
            "probability": probability,
            "target": target,
        }
    )


def with_dropouts(sensors: set[str], probability: float) -> ScenarioConfig:
    changed = {
        sensor: getattr(CONFIG.sensors, sensor).model_copy(update={"dropout_probability": probability})
        for sensor in sensors
    }
    return CONFIG.model_copy(update={"sensors": CONFIG.sensors.model_copy(update=changed)})


def assert_the_rest_is_the_same(
    reference: list[VehicleMeasurements], other: list[VehicleMeasurements], *, may_lose: set[str]
) -> None:
    for expected, actual in zip(reference, other, strict=True):
        for sensor in SENSORS:
            message = actual.by_sensor.get(sensor)
            if message is None:
                assert sensor in may_lose or sensor not in expected.by_sensor
            elif sensor == "range_bearing" and sensor in may_lose:
                for target, seen in message[-1].by_target.items():
                    assert bits(seen) == bits(expected.newest(RANGE_BEARING).by_target[target])
            else:
                assert bits(message) == bits(expected.by_sensor[sensor])


@given(
    seed=st.integers(0, 2**32),
    name=st.sampled_from(CONFIG.team.vehicles),
    sensors=sensor_sets,
    probability=probabilities,
)
def test_configured_dropouts_change_no_other_draw(
    seed: int, name: str, sensors: set[str], probability: float
) -> None:
    dropped = fly(with_dropouts(sensors, probability), name, seed)
    assert_the_rest_is_the_same(fly(CONFIG, name, seed), dropped, may_lose=sensors)


@given(
    seed=st.integers(0, 2**32),
    name=st.sampled_from(CONFIG.team.vehicles),
    sensors=sensor_sets,
    probability=probabilities,
    start=st.floats(0.0, 0.3),
)
def test_dropout_events_change_no_other_draw(
    seed: int, name: str, sensors: set[str], probability: float, start: float
) -> None:
    sensors = sensors - {"localization"} if name != CONFIG.team.leader else sensors
    events = tuple(dropout(sensor, start, probability, name) for sensor in sorted(sensors))
    dropped = fly(CONFIG.model_copy(update={"events": events}), name, seed)
    assert_the_rest_is_the_same(fly(CONFIG, name, seed), dropped, may_lose=sensors)


@given(
    seed=st.integers(0, 2**32),
    hidden=st.fixed_dictionaries({"follower_1": step_sets, "follower_2": step_sets}),
)
def test_targets_out_of_view_change_no_other_draw(seed: int, hidden: dict[str, set[int]]) -> None:
    reference = fly(CONFIG, "leader", seed)
    for step, (expected, actual) in enumerate(
        zip(reference, fly(CONFIG, "leader", seed, hidden), strict=True)
    ):
        visible = [name for name in ("follower_1", "follower_2") if step not in hidden[name]]
        assert list(actual.newest(RANGE_BEARING).by_target) == visible
        for name in visible:
            assert bits(actual.newest(RANGE_BEARING).by_target[name]) == bits(
                expected.newest(RANGE_BEARING).by_target[name]
            )
        assert bits(actual.newest(IMU)) == bits(expected.newest(IMU))


@given(seed=st.integers(0, 2**32), probability=probabilities, start=st.floats(0.0, 0.2))
def test_outliers_change_no_other_draw(seed: int, probability: float, start: float) -> None:
    event = Outliers(
        kind="outliers",
        start_s=start,
        end_s=0.25,
        target="follower_1",
        probability=probability,
        range_std_m=1.0,
        bearing_std_deg=60.0,
    )
    reference = fly(CONFIG, "follower_1", seed)
    hit = fly(CONFIG.model_copy(update={"events": (event,)}), "follower_1", seed)
    for step, (expected, actual) in enumerate(zip(reference, hit, strict=True)):
        acting = start <= step * 0.05 < 0.25 and probability > 0.0
        for sensor in SENSORS:
            if sensor != "range_bearing" or not acting:
                assert bits(actual.by_sensor.get(sensor)) == bits(expected.by_sensor.get(sensor))


@given(seed=st.integers(0, 2**32))
def test_equal_seeds_give_equal_bits_and_vehicles_and_seeds_differ(seed: int) -> None:
    flight = bits(fly(CONFIG, "follower_1", seed))
    assert flight == bits(fly(CONFIG, "follower_1", seed))
    assert flight != bits(fly(CONFIG, "follower_1", seed + 1))
    own, others = fly(CONFIG, "follower_1", seed)[0], fly(CONFIG, "follower_2", seed)[0]
    truth = ground_truth(0, {})
    assert not np.allclose(
        own.newest(IMU).w_NB_B - truth["follower_1"].w_NB_B,
        others.newest(IMU).w_NB_B - truth["follower_2"].w_NB_B,
    )


def test_losses_of_events_and_of_the_configuration_are_independent() -> None:
    config = with_dropouts({"imu", "sonar"}, 0.5).model_copy(
        update={"events": (dropout("imu", 0.0, 0.5, "follower_2"), dropout("sonar", 0.0, 1.0, "follower_1"))}
    )
    flights = [fly(config, "follower_2", seed) for seed in range(200)]
    arrived = {
        sensor: np.mean([sensor in step.by_sensor for flight in flights for step in flight])
        for sensor in ("imu", "sonar", "optic_flow")
    }
    assert abs(arrived["imu"] - 0.25) < 0.05
    assert abs(arrived["sonar"] - 0.5) < 0.06  # the event hits another vehicle
    assert arrived["optic_flow"] == 1.0


def test_only_the_leader_is_localized() -> None:
    assert all(step.newest(LOCALIZATION) is not None for step in fly(CONFIG, "leader", 1))
    assert all(step.newest(LOCALIZATION) is None for step in fly(CONFIG, "follower_1", 1))


@given(seed=st.integers(0, 2**32), name=st.sampled_from(CONFIG.team.vehicles))
def test_an_optional_sensor_changes_no_draw_of_the_others(seed: int, name: str) -> None:
    for without, with_it in zip(fly(PAPER, name, seed), fly(CONFIG, name, seed), strict=True):
        assert set(with_it.by_sensor) - set(without.by_sensor) == {"barometer"}
        for sensor, measurements in without.by_sensor.items():
            assert bits(with_it.by_sensor[sensor]) == bits(measurements)
