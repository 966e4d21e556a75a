"""Air pressure; optional, for the paper has no barometer."""

from dataclasses import dataclass
from typing import Annotated

from pydantic import Field

from relform_core.schema import NonNegative, Positive
from relform_core.sensors.sensor import Sensor, SensorConfig


class BarometerConfig(SensorConfig):
    """Air pressure."""

    pressure_std: Annotated[Positive, Field(alias="pressure_std_pa", examples=[6.0])]
    """Standard deviation of the noise of each measurement."""
    bias_std: Annotated[NonNegative, Field(alias="bias_std_pa", examples=[50.0])]
    """Standard deviation of the offset, which is drawn once per flight."""
    drift_std: Annotated[NonNegative, Field(alias="drift_std_pa_s", examples=[0.1])]
    """Standard deviation of the constant rate at which the offset drifts, drawn once per flight."""


@dataclass(frozen=True)
class AirPressure:
    """sensor_msgs/FluidPressure."""

    stamp_ns: int
    pressure: float
    """Absolute [Pa]."""
    variance: float
    """Of the noise, without the offset [Pa^2]."""


BAROMETER = Sensor("barometer", AirPressure, BarometerConfig, stream=7, optional=True)
