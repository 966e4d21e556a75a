"""Schema of ``config/sensors/*.yaml``: what every vehicle of a team measures, and how badly."""

import math
from typing import Annotated, Self

from pydantic import Field, model_validator

from relform_core.schema import NonNegative, Positive, Probability, Schema
from relform_core.units import DEGREES


class ImuConfig(Schema):
    """Attitude, angular velocity and specific force."""

    attitude_std: Annotated[float, Field(alias="attitude_std_deg", ge=0.0, le=180.0), DEGREES]
    gyro_std: Annotated[float, Field(alias="gyro_std_deg_s", ge=0.0), DEGREES]
    accelerometer_std: Annotated[NonNegative, Field(alias="accelerometer_std_m_s2")]
    yaw_drift_std: Annotated[float, Field(alias="yaw_drift_std_deg_s", ge=0.0), DEGREES]
    """Standard deviation of the constant rate at which a follower's yaw drifts [rad/s]."""
    dropout_probability: Probability


class OpticFlowConfig(Schema):
    """Velocity in the body frame."""

    velocity_std: Annotated[NonNegative, Field(alias="velocity_std_m_s")]
    dropout_probability: Probability


class SonarConfig(Schema):
    """Height above ground."""

    range_std: Annotated[NonNegative, Field(alias="range_std_m")]
    range_min: Annotated[NonNegative, Field(alias="range_min_m")]
    range_max: Annotated[Positive, Field(alias="range_max_m")]
    field_of_view: Annotated[float, Field(alias="field_of_view_deg", gt=0.0, lt=180.0), DEGREES]
    dropout_probability: Probability

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if self.range_min >= self.range_max:
            raise ValueError(f"range_min_m {self.range_min} must be less than range_max_m {self.range_max}")
        return self


class Sector(Schema):
    """A part of the field of view, in the body frame of the observer."""

    azimuth_min: Annotated[float, Field(alias="azimuth_min_deg", ge=-180.0, le=180.0), DEGREES]
    azimuth_max: Annotated[float, Field(alias="azimuth_max_deg", ge=-180.0, le=180.0), DEGREES]
    """May be less than azimuth_min: the sector then spans the backward direction."""
    elevation_min: Annotated[float, Field(alias="elevation_min_deg", ge=-90.0, le=90.0), DEGREES]
    elevation_max: Annotated[float, Field(alias="elevation_max_deg", ge=-90.0, le=90.0), DEGREES]

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if self.elevation_min >= self.elevation_max:
            lowest, highest = math.degrees(self.elevation_min), math.degrees(self.elevation_max)
            raise ValueError(f"elevation_min_deg {lowest:g} must be less than elevation_max_deg {highest:g}")
        if math.isclose(self.azimuth_min, self.azimuth_max):
            azimuth = math.degrees(self.azimuth_min)
            raise ValueError(f"azimuth_min_deg and azimuth_max_deg must differ, both are {azimuth:g}")
        return self


class RangeBearingConfig(Schema):
    """Range and bearing to the other vehicles."""

    position_std: Annotated[Positive, Field(alias="position_std_m")]
    """Standard deviation of the relative position along the line of sight and across it [m]."""
    range_min: Annotated[NonNegative, Field(alias="range_min_m")]
    range_max: Annotated[Positive, Field(alias="range_max_m")]
    sectors: Annotated[tuple[Sector, ...], Field(min_length=1)]
    dropout_probability: Probability

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if self.range_min >= self.range_max:
            raise ValueError(f"range_min_m {self.range_min} must be less than range_max_m {self.range_max}")
        return self


class LocalizationConfig(Schema):
    """Position, velocity and yaw in the world frame; only the leader has it."""

    position_std: Annotated[Positive, Field(alias="position_std_m")]
    velocity_std: Annotated[Positive, Field(alias="velocity_std_m_s")]
    yaw_std: Annotated[float, Field(alias="yaw_std_deg", gt=0.0, le=180.0), DEGREES]
    dropout_probability: Probability


class SensorsConfig(Schema):
    """The sensors of every vehicle of a team."""

    imu: ImuConfig
    optic_flow: OpticFlowConfig
    sonar: SonarConfig
    range_bearing: RangeBearingConfig
    localization: LocalizationConfig
