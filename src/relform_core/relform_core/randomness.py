"""One seed for everything: generators spawned with fixed keys, none depending on another's draws."""

from enum import IntEnum

import numpy as np


class Stream(IntEnum):
    """What a generator is for. The numbers are part of the recorded results: append, never renumber."""

    PLANT = 0
    IMU = 1
    OPTIC_FLOW = 2
    SONAR = 3
    RANGE_BEARING = 4
    LOCALIZATION = 5
    LINK = 6


def spawn_generator(seed: int, vehicle_index: int, stream: Stream) -> np.random.Generator:
    """Generator of one stream of one vehicle (index in team order)."""
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(vehicle_index, int(stream))))
