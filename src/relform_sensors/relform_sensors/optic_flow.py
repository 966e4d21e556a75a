"""Velocity in the body frame."""

import numpy as np

from relform_core.measurements import Odometry
from relform_core.sensors.optic_flow import OpticFlow, OpticFlowConfig
from relform_sensors.model import Carrier, Read


class OpticFlowSensor:
    """Optic flow scaled by its own height: the velocity, with the same noise on every axis."""

    def __init__(self, config: OpticFlowConfig, generator: np.random.Generator) -> None:
        self._config = config
        self._generator = generator
        self._covariance = config.velocity_std**2 * np.eye(3)

    def read(self, truth: Odometry) -> OpticFlow:
        """Measure the velocity of the vehicle with this true state."""
        noise = self._config.velocity_std * self._generator.standard_normal(3)
        return OpticFlow(truth.stamp_ns, truth.v_NB_B + noise, self._covariance)


def mount(config: OpticFlowConfig, generator: np.random.Generator, carrier: Carrier) -> Read:
    """The model on this vehicle."""
    sensor = OpticFlowSensor(config, generator)
    return lambda scene: sensor.read(scene.own)
