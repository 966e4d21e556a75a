"""Containers of measurements: several per sensor, each with its own stamp."""

from relform_core.measurements import VehicleMeasurements
from relform_core.sensors.imu import IMU
from relform_core.sensors.registry import SENSORS
from relform_core.sensors.sonar import SONAR, Sonar


def sonar(stamp_ns: int, height: float) -> Sonar:
    return Sonar(stamp_ns, height, 0.2, 10.0, 0.5)


def test_measurements_are_sorted_by_stamp_whatever_the_order_of_arrival() -> None:
    old, middle, new = sonar(100, 1.0), sonar(200, 2.0), sonar(300, 3.0)
    measurements = VehicleMeasurements.collect([(SONAR, middle), (SONAR, new), (SONAR, old)])
    assert measurements.arrived(SONAR) == (old, middle, new)
    assert measurements.newest(SONAR) is new


def test_a_sensor_without_measurements_has_none() -> None:
    measurements = VehicleMeasurements.collect([(SONAR, sonar(100, 1.0))])
    assert measurements.newest(IMU) is None
    assert measurements.arrived(IMU) == ()


def test_of_two_measurements_with_the_same_stamp_the_last_to_arrive_is_the_newest() -> None:
    first, second = sonar(100, 1.0), sonar(100, 2.0)
    assert VehicleMeasurements.collect([(SONAR, first), (SONAR, second)]).newest(SONAR) is second


def test_names_and_random_streams_of_the_sensors_differ() -> None:
    assert len({sensor.name for sensor in SENSORS}) == len(SENSORS)
    assert len({sensor.stream for sensor in SENSORS}) == len(SENSORS)
