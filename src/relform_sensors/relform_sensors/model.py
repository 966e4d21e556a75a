"""Inputs of a sensor model, and the look-up of the model by the name of its sensor."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib import import_module
from typing import Any

import numpy as np

from relform_core.arrays import Array
from relform_core.events_config import Event
from relform_core.measurements import Odometry
from relform_core.scenario_config import ScenarioConfig
from relform_core.sensors.sensor import Measurement, Sensor


@dataclass(frozen=True)
class Carrier:
    """The vehicle that carries a sensor."""

    name: str
    vehicles: tuple[str, ...]
    """All vehicles in team order, leader first."""
    events: tuple[Event, ...]
    """Those that hit the carrier."""
    targets: tuple[str, ...]
    """The vehicles that it may see, in team order."""

    @classmethod
    def of(cls, config: ScenarioConfig, name: str) -> "Carrier":
        """The vehicle ``name``, which must be in the team."""
        return cls(name, config.team.vehicles, config.events_on(name), config.targets_of[name])

    @property
    def is_leader(self) -> bool:
        """Whether the carrier leads the team."""
        return self.name == self.vehicles[0]


@dataclass(frozen=True, eq=False)
class Scene:
    """The true world around one vehicle at one instant."""

    name: str
    """Of the vehicle."""
    ground_truth: Mapping[str, Odometry]
    """States of all vehicles by name."""
    f_NB_B: Array
    """Specific force of the vehicle [m/s^2], shape (3,)."""

    @property
    def own(self) -> Odometry:
        """State of the vehicle."""
        return self.ground_truth[self.name]


Read = Callable[[Scene], Measurement]
"""Model of a mounted sensor, called once per step."""


def mount(sensor: Sensor[Any, Any], config: Any, generator: np.random.Generator, carrier: Carrier) -> Read:
    """Make the model of a sensor by the function ``mount`` of the module of its name.

    Args:
        config: the section on this sensor.
        generator: of its random stream.
        carrier: the vehicle.
    """
    read: Read = import_module(f"relform_sensors.{sensor.name}").mount(config, generator, carrier)
    return read
