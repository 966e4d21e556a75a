"""One seed, many streams that do not touch each other."""

import itertools

import numpy as np

from relform_core.randomness import Stream, spawn_generator


def test_the_same_keys_give_the_same_draws() -> None:
    first, second = (spawn_generator(7, 1, Stream.OPTIC_FLOW).standard_normal(50) for _ in range(2))
    np.testing.assert_array_equal(first, second)


def test_any_other_key_gives_others() -> None:
    draws = {
        keys: tuple(spawn_generator(*keys).standard_normal(3))
        for keys in itertools.product((0, 1, 7), (0, 1, 2), Stream)
    }
    assert len(set(draws.values())) == 3 * 3 * len(Stream)


def test_streams_are_not_correlated() -> None:
    draws = [
        spawn_generator(3, vehicle, stream).standard_normal(2000) for vehicle in range(3) for stream in Stream
    ]
    correlation = np.corrcoef(draws) - np.eye(len(draws))
    assert np.abs(correlation).max() < 0.1  # five standard deviations


def test_the_numbers_of_streams_are_kept() -> None:
    """Recorded results depend on them."""
    assert [(stream.name, stream.value) for stream in Stream][:7] == [
        ("PLANT", 0),
        ("IMU", 1),
        ("OPTIC_FLOW", 2),
        ("SONAR", 3),
        ("RANGE_BEARING", 4),
        ("LOCALIZATION", 5),
        ("LINK", 6),
    ]
    assert spawn_generator(42, 1, Stream.IMU).integers(2**32) == 3226071672
