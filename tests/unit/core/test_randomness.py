"""Independent random streams from one seed."""

import itertools

import numpy as np

from relform_core.randomness import Stream, Streams, spawn_generator
from relform_core.sensors.imu import IMU
from relform_core.sensors.optic_flow import OPTIC_FLOW
from relform_core.sensors.registry import SENSORS

KEYS = (*Stream, *(sensor.stream for sensor in SENSORS))


def test_the_same_keys_give_the_same_draws() -> None:
    first, second = (spawn_generator(7, 1, OPTIC_FLOW.stream).standard_normal(50) for _ in range(2))
    np.testing.assert_array_equal(first, second)


def test_another_key_gives_other_draws() -> None:
    draws = {
        keys: tuple(spawn_generator(*keys).standard_normal(3))
        for keys in itertools.product((0, 1, 7), (0, 1, 2), KEYS)
    }
    assert len(set(draws.values())) == 3 * 3 * len(KEYS)


def test_streams_are_not_correlated() -> None:
    draws = [
        spawn_generator(3, vehicle, stream).standard_normal(2000) for vehicle in range(3) for stream in KEYS
    ]
    correlation = np.corrcoef(draws) - np.eye(len(draws))
    assert np.abs(correlation).max() < 0.1  # five standard deviations


def test_the_numbers_of_streams_are_kept() -> None:
    """Recorded results depend on them."""
    numbers = (Stream.PLANT, Stream.LINK, Stream.LINK_UP, Stream.LINK_DOWN, Stream.START)
    assert numbers == (0, 6, 8, 9, 10)
    assert {sensor.name: sensor.stream for sensor in SENSORS[:5]} == {
        "imu": 1,
        "optic_flow": 2,
        "sonar": 3,
        "range_bearing": 4,
        "localization": 5,
    }
    assert spawn_generator(42, 1, IMU.stream).integers(2**32) == 3226071672


def test_no_stream_is_used_twice() -> None:
    assert len(set(KEYS)) == len(KEYS)


def test_a_key_always_gives_the_same_generator() -> None:
    streams = Streams(7, 1)
    assert streams[IMU.stream] is streams[IMU.stream]
    assert streams[IMU.stream].integers(2**32) == spawn_generator(7, 1, IMU.stream).integers(2**32)
