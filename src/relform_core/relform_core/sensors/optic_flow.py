"""Velocity in the body frame."""

from dataclasses import dataclass
from typing import Annotated

from pydantic import Field

from relform_core.arrays import Array
from relform_core.schema import NonNegative
from relform_core.sensors.sensor import Sensor, SensorConfig


class OpticFlowConfig(SensorConfig):
    """Velocity in the body frame."""

    velocity_std: Annotated[NonNegative, Field(alias="velocity_std_m_s", examples=[0.25])]
    """Standard deviation of the noise of the velocity along each body axis."""


@dataclass(frozen=True, eq=False)
class OpticFlow:
    """geometry_msgs/TwistWithCovarianceStamped: velocity in the body frame."""

    stamp_ns: int
    v_NB_B: Array
    """[m/s], shape (3,)."""
    covariance: Array
    """[(m/s)^2], shape (3, 3)."""


OPTIC_FLOW = Sensor("optic_flow", OpticFlow, OpticFlowConfig, stream=2)
