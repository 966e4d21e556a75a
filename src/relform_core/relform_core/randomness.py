"""Random generators: all come from one seed by fixed keys, and none depends on the draws of another."""

from enum import IntEnum

import numpy as np


class Stream(IntEnum):
    """What a generator is for. Each sensor has a key of its own, see `sensors.sensor.Sensor.stream`.

    The numbers are part of the recorded results: append, never renumber.
    """

    PLANT = 0
    LINK = 6
    """Commands that an event loses."""
    LINK_UP = 8
    """Packets to the controller; the barometer has 7."""
    LINK_DOWN = 9
    START = 10
    FAULTS = 20
    """What is done to a flight of the fault campaign."""


class Streams:
    """The generators of one vehicle: one per key, shared by all models that use the key."""

    def __init__(self, seed: int, vehicle_index: int) -> None:
        """Seed of the flight, and index of the vehicle in team order."""
        self._seed = seed
        self._vehicle_index = vehicle_index
        self._generators: dict[int, np.random.Generator] = {}

    def __getitem__(self, stream: int) -> np.random.Generator:
        """Generator of a stream: a `Stream` or the key of a sensor."""
        if stream not in self._generators:
            self._generators[stream] = spawn_generator(self._seed, self._vehicle_index, stream)
        return self._generators[stream]


def spawn_generator(seed: int, vehicle_index: int, stream: int) -> np.random.Generator:
    """New generator of one stream of one vehicle (index in team order)."""
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(vehicle_index, stream)))
