"""Units of configuration files: keys end in their unit; everything in the code is SI and radians.

The annotations here convert once, on loading, after the bounds of the key were checked in the unit of the
file: ``tilt_max: Annotated[float, Field(alias="tilt_max_deg", gt=0, le=90), DEGREES]``.
"""

import math

from pydantic import AfterValidator

NANOSECONDS_PER_SECOND = 1_000_000_000
GRAVITY = 9.81
"""Magnitude of the gravitational acceleration [m/s^2], one value for plant, sensors and prediction model."""


def rpm_to_rad_s(speed_rpm: float) -> float:
    """Revolutions per minute to rad/s."""
    return speed_rpm * math.tau / 60.0


def rad_s_to_rpm(speed: float) -> float:
    """Angular speed in rad/s to revolutions per minute."""
    return speed * 60.0 / math.tau


def seconds_to_ns(time: float) -> int:
    """Seconds to integer nanoseconds, rounded to the nearest."""
    return round(time * NANOSECONDS_PER_SECOND)


DEGREES = AfterValidator(math.radians)
RPM = AfterValidator(rpm_to_rad_s)
PERCENT = AfterValidator(lambda percent: percent / 100.0)
