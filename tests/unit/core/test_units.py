"""Conversion of units."""

import math

import pytest

from relform_core.units import rad_s_to_rpm, rpm_to_rad_s, seconds_to_ns


def test_rotor_speeds() -> None:
    assert rpm_to_rad_s(6000.0) == pytest.approx(628.3185307179587)
    assert rad_s_to_rpm(math.pi) == pytest.approx(30.0)


@pytest.mark.parametrize(("seconds", "ns"), [(0.05, 50_000_000), (0.1 + 0.2, 300_000_000), (1e-9, 1)])
def test_times_become_the_nearest_nanosecond(seconds: float, ns: int) -> None:
    assert seconds_to_ns(seconds) == ns
    assert isinstance(seconds_to_ns(seconds), int)
