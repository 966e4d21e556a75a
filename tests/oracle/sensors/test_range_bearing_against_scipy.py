"""Geometry of range and bearing against scipy's rotations, over all attitudes and offsets."""

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from relform_core.load import load_scenario
from relform_core.measurements import Odometry
from relform_sensors.range_bearing import RangeBearingSensor

CONFIG = load_scenario(
    Path(__file__).parents[3] / "config/scenarios/paper.yaml",
    [
        "sensors.range_bearing.position_std_m=1.0e-12",
        "sensors.range_bearing.range_max_m=100.0",
        "sensors.range_bearing.sectors.0.elevation_min_deg=-90.0",
        "sensors.range_bearing.sectors.0.elevation_max_deg=90.0",
    ],
).config.sensors.range_bearing
ZEROS = np.zeros((6, 6))

positions = st.tuples(*[st.floats(-20.0, 20.0)] * 3).map(np.array)
attitudes = st.tuples(*[st.floats(-4.0, 4.0)] * 3).map(Rotation.from_rotvec)


@given(positions, positions, attitudes, attitudes)
def test_bearing_leads_from_the_observer_to_the_target(
    p_NB1_N: np.ndarray, p_NB2_N: np.ndarray, attitude_1: Rotation, attitude_2: Rotation
) -> None:
    distance = math.dist(p_NB1_N, p_NB2_N)
    assume(distance > 0.2)
    truth = {
        "one": Odometry(7, p_NB1_N, attitude_1.as_quat(), np.ones(3), np.ones(3), ZEROS, ZEROS),
        "two": Odometry(7, p_NB2_N, attitude_2.as_quat(), np.ones(3), np.ones(3), ZEROS, ZEROS),
    }
    generator = np.random.default_rng(0)
    there = RangeBearingSensor(CONFIG, generator, "one", ["two"], ()).read(truth).by_target["two"]
    back = RangeBearingSensor(CONFIG, generator, "two", ["one"], ()).read(truth).by_target["one"]
    for measured, attitude, p_BT_N in (
        (there, attitude_1, p_NB2_N - p_NB1_N),
        (back, attitude_2, p_NB1_N - p_NB2_N),
    ):
        assert measured.range == pytest.approx(distance)
        # eq. CameraRange1, carried back into the world
        p_BT_B = measured.range * np.array(
            [
                math.cos(measured.elevation) * math.cos(measured.azimuth),
                math.cos(measured.elevation) * math.sin(measured.azimuth),
                math.sin(measured.elevation),
            ]
        )
        assert attitude.apply(p_BT_B) == pytest.approx(p_BT_N, abs=1e-9)
