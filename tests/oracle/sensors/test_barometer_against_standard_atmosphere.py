"""Pressure against the published table of the standard atmosphere and against hydrostatics."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from relform_sensors.barometer import standard_pressure


@pytest.mark.parametrize(
    ("altitude", "pressure"),
    [
        (0.0, 101_325.0),
        (500.0, 95_460.8),
        (1000.0, 89_874.6),
        (2000.0, 79_495.2),
        (5000.0, 54_019.9),
        (11_000.0, 22_632.1),
    ],
)
def test_table_of_iso_2533(altitude: float, pressure: float) -> None:
    """Geopotential altitude [m], pressure [Pa], as printed."""
    assert standard_pressure(altitude) == pytest.approx(pressure, abs=0.06)


@given(st.floats(0.0, 1000.0))
def test_pressure_satisfies_hydrostatics(altitude: float) -> None:
    """dp/dz = -g p M / (R T), integrated from sea level, with the molar constants."""

    def rate(z: float, p: list[float]) -> list[float]:
        temperature = 288.15 - 6.5e-3 * z
        return [-9.80665 * p[0] * 0.0289644 / (8.31432 * temperature)]

    solution = solve_ivp(rate, (0.0, altitude), [101_325.0], rtol=1e-10, atol=1e-6)
    assert standard_pressure(altitude) == pytest.approx(solution.y[0, -1], rel=1e-7)
