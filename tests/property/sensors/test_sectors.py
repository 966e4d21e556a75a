"""A bearing is in a sector exactly if its margin is not negative."""

import math

import numpy as np
from hypothesis import assume, given
from hypothesis import strategies as st

from relform_core.sensors.range_bearing import Sector

degrees = st.floats(-180.0, 180.0)


@given(
    azimuths=st.tuples(degrees, degrees),
    elevations=st.tuples(st.floats(-90.0, 90.0), st.floats(-90.0, 90.0)),
    azimuth=st.floats(-math.pi, math.pi),
    elevation=st.floats(-math.pi / 2, math.pi / 2),
)
def test_contains_agrees_with_margins(
    azimuths: tuple[float, float], elevations: tuple[float, float], azimuth: float, elevation: float
) -> None:
    assume(abs(azimuths[0] - azimuths[1]) > 1e-6)
    assume(abs(elevations[0] - elevations[1]) > 1e-6)
    sector = Sector(
        azimuth_min_deg=azimuths[0],
        azimuth_max_deg=azimuths[1],
        elevation_min_deg=min(elevations),
        elevation_max_deg=max(elevations),
    )
    (margin,) = sector.margins(np.array([azimuth]), np.array([elevation]))
    assume(abs(margin) > 1e-9)
    assert sector.contains(azimuth, elevation) == (margin > 0.0)
