"""Range and bearing to the other vehicles."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Self

import numpy as np
from pydantic import Field, model_validator

from relform_core.arrays import Array
from relform_core.schema import NonNegative, Positive, Schema
from relform_core.sensors.sensor import Sensor, SensorConfig
from relform_core.units import DEGREES

FULL_CIRCLE_TOLERANCE = 1e-9
"""[rad]."""


class Sector(Schema):
    """A part of the field of view, in the body frame of the observer."""

    azimuth_min: Annotated[
        float, Field(alias="azimuth_min_deg", ge=-180.0, le=180.0, examples=[-60.0]), DEGREES
    ]
    """Right limit; 0 is forward, positive is to the left."""
    azimuth_max: Annotated[
        float, Field(alias="azimuth_max_deg", ge=-180.0, le=180.0, examples=[60.0]), DEGREES
    ]
    """Left limit. If it is less than ``azimuth_min_deg``, the sector spans the backward direction."""
    elevation_min: Annotated[
        float, Field(alias="elevation_min_deg", ge=-90.0, le=90.0, examples=[-45.0]), DEGREES
    ]
    """Lower limit; less than ``elevation_max_deg``."""
    elevation_max: Annotated[
        float, Field(alias="elevation_max_deg", ge=-90.0, le=90.0, examples=[45.0]), DEGREES
    ]
    """Upper limit; positive is up."""

    def contains(self, azimuth: float, elevation: float) -> bool:
        """Whether a bearing [rad] is in the sector, its limits included; the azimuth is in [-pi, pi]."""
        if not self.elevation_min <= elevation <= self.elevation_max:
            return False
        if self.azimuth_min < self.azimuth_max:
            return self.azimuth_min <= azimuth <= self.azimuth_max
        return azimuth >= self.azimuth_min or azimuth <= self.azimuth_max  # spans the backward direction

    def margins(self, azimuth: Array, elevation: Array) -> Array:
        """Angles from bearings to the nearest limit, negative outside [rad]; all of the same shape.

        A sector of all azimuths has no limit there.
        """
        vertical: Array = np.minimum(elevation - self.elevation_min, self.elevation_max - elevation)
        width = (self.azimuth_max - self.azimuth_min) % math.tau
        if min(width, math.tau - width) < FULL_CIRCLE_TOLERANCE:
            return vertical
        middle = self.azimuth_min + width / 2.0
        away = np.abs(np.remainder(azimuth - middle + math.pi, math.tau) - math.pi)
        return np.minimum(vertical, width / 2.0 - away)

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if self.elevation_min >= self.elevation_max:
            lowest, highest = math.degrees(self.elevation_min), math.degrees(self.elevation_max)
            raise ValueError(f"elevation_min_deg {lowest:g} must be less than elevation_max_deg {highest:g}")
        if math.isclose(self.azimuth_min, self.azimuth_max):
            azimuth = math.degrees(self.azimuth_min)
            raise ValueError(f"azimuth_min_deg and azimuth_max_deg must differ, both are {azimuth:g}")
        return self


class RangeBearingConfig(SensorConfig):
    """Range and bearing to the other vehicles; a dropout hides a single target."""

    position_std: Annotated[Positive, Field(alias="position_std_m", examples=[0.025])]
    """Standard deviation of the noise of the relative position along the line of sight and across it."""
    range_min: Annotated[NonNegative, Field(alias="range_min_m", examples=[0.1])]
    """Smallest range that is measured; less than ``range_max_m``."""
    range_max: Annotated[Positive, Field(alias="range_max_m", examples=[10.0])]
    """Largest range that is measured."""
    sectors: Annotated[tuple[Sector, ...], Field(min_length=1)]
    """The field of view: a target is seen if it is in one of these."""

    @property
    def message_loss(self) -> float:
        """Probability that a whole message is lost: 0, for a dropout hides a single target."""
        return 0.0

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if self.range_min >= self.range_max:
            raise ValueError(f"range_min_m {self.range_min} must be less than range_max_m {self.range_max}")
        return self


@dataclass(frozen=True, eq=False)
class RangeBearing:
    """relform_msgs/RangeBearing: one target in the observer's body frame (eqs. CameraRange1, 2)."""

    target: str
    range: float
    azimuth: float
    elevation: float
    covariance: Array
    """Of range, azimuth, elevation, shape (3, 3)."""


@dataclass(frozen=True, eq=False)
class RangeBearings:
    """relform_msgs/RangeBearingArray: all targets that one vehicle sees at one instant."""

    stamp_ns: int
    by_target: Mapping[str, RangeBearing]


RANGE_BEARING = Sensor("range_bearing", RangeBearings, RangeBearingConfig, stream=4)
