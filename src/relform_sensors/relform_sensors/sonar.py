"""Height above the flat ground."""

import math

import numpy as np

from relform_core.measurements import Odometry
from relform_core.sensors.sonar import Sonar, SonarConfig
from relform_sensors.model import Carrier, Read


class SonarSensor:
    """Downward sonar, corrected for tilt: the height above the ground z = 0, at any attitude."""

    def __init__(self, config: SonarConfig, generator: np.random.Generator) -> None:
        self._range_std = config.range_std
        self._generator = generator
        self._range_min = _float32(config.range_min)
        self._range_max = _float32(config.range_max)
        self._field_of_view = _float32(config.field_of_view)

    def read(self, truth: Odometry) -> Sonar:
        """Measure the height of the vehicle with this true state."""
        height = _float32(float(truth.p_NB_N[2]) + self._range_std * self._generator.standard_normal())
        # REP-117: a range beyond a limit is infinite, with the sign of the side.
        if height < self._range_min:
            height = -math.inf
        elif height > self._range_max:
            height = math.inf
        return Sonar(truth.stamp_ns, height, self._range_min, self._range_max, self._field_of_view)


def mount(config: SonarConfig, generator: np.random.Generator, carrier: Carrier) -> Read:
    """The model on this vehicle."""
    sensor = SonarSensor(config, generator)
    return lambda scene: sensor.read(scene.own)


def _float32(value: float) -> float:
    """The nearest value that sensor_msgs/Range can hold."""
    return float(np.float32(value))
