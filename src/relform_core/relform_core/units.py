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


UNITS = {
    "s": "s",
    "m": "m",
    "m_s": "m/s",
    "m_s2": "m/s²",
    "deg": "deg",
    "deg_s": "deg/s",
    "rpm": "rpm",
    "percent": "%",
    "kg": "kg",
    "kg_m2": "kg m²",
    "n": "N",
    "n_s2": "N s²",
    "nm_s2": "N m s²",
    "n_s_m": "N s/m",
    "pa": "Pa",
    "pa_s": "Pa/s",
    "per_m2": "1/m²",
    "per_rad2": "1/rad²",
    "per_m2_s4": "s⁴/m²",
    "per_n2": "1/N²",
    "per_n2_m2": "1/(N² m²)",
    "per_unit": "1/unit",
    "per_unit2": "1/unit²",
}
"""The unit that a key of a file ends in, as people write it."""


def unit_of(key: str) -> str | None:
    """The unit in which a file gives the value of a key; None: the key ends in none."""
    parts = key.split("_")
    endings = ("_".join(parts[start:]) for start in range(1, len(parts)))  # the longest first
    return next((UNITS[ending] for ending in endings if ending in UNITS), None)


DEGREES = AfterValidator(math.radians)
RPM = AfterValidator(rpm_to_rad_s)
PERCENT = AfterValidator(lambda percent: percent / 100.0)
