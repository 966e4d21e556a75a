"""Air pressure of the standard atmosphere."""

import numpy as np

from relform_core.measurements import Odometry
from relform_core.sensors.barometer import AirPressure, BarometerConfig
from relform_core.units import NANOSECONDS_PER_SECOND
from relform_sensors.model import Carrier, Read

# ISO 2533: temperature falls linearly up to 11 km.
SEA_LEVEL_PRESSURE = 101_325.0
"""[Pa]."""
SEA_LEVEL_TEMPERATURE = 288.15
"""[K]."""
LAPSE_RATE = 0.0065
"""Fall of the temperature with altitude [K/m]."""
GAS_CONSTANT = 287.05287
"""Of air [J/(kg K)]."""
STANDARD_GRAVITY = 9.80665
"""By which the standard atmosphere is defined [m/s^2]."""


def standard_pressure(altitude: float) -> float:
    """Pressure [Pa] of the standard atmosphere at an altitude above sea level [m], at most 11 km."""
    temperature_ratio = 1.0 - LAPSE_RATE * altitude / SEA_LEVEL_TEMPERATURE
    exponent = STANDARD_GRAVITY / (GAS_CONSTANT * LAPSE_RATE)
    return float(SEA_LEVEL_PRESSURE * temperature_ratio**exponent)


class BarometerSensor:
    """Barometer over ground at sea level: an offset and its drift, drawn once per flight, and noise."""

    def __init__(self, config: BarometerConfig, generator: np.random.Generator) -> None:
        self._config = config
        self._generator = generator
        self.bias = config.bias_std * generator.standard_normal()
        self.drift_rate = config.drift_std * generator.standard_normal()

    def read(self, truth: Odometry) -> AirPressure:
        """Measure the pressure at the height of the vehicle with this true state."""
        offset = self.bias + self.drift_rate * (truth.stamp_ns / NANOSECONDS_PER_SECOND)
        noise = self._config.pressure_std * self._generator.standard_normal()
        pressure = standard_pressure(float(truth.p_NB_N[2])) + offset + noise
        return AirPressure(truth.stamp_ns, float(pressure), self._config.pressure_std**2)


def mount(config: BarometerConfig, generator: np.random.Generator, carrier: Carrier) -> Read:
    """The model on this vehicle."""
    sensor = BarometerSensor(config, generator)
    return lambda scene: sensor.read(scene.own)
