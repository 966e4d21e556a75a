"""Margins of the field of view, against bearings worked out by hand and the sensor itself."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from relform_analysis.flight.log import FlightLog
from relform_analysis.flight.log_builder import FlightLogBuilder
from relform_analysis.flight.view_margins import view_margins
from relform_core.measurements import Odometry
from relform_sensors.range_bearing import RangeBearingSensor
from support.logs import odometry
from support.scenarios import paper_scenario

FOLLOWERS = ("follower_1", "follower_2")


def log_of(states: list[Odometry], *overrides: str) -> FlightLog:
    builder = FlightLogBuilder(paper_scenario(*overrides))
    for name, state in zip(("leader", *FOLLOWERS), states, strict=True):
        builder.add_ground_truth(name, state)
    return builder.build()


def sectors(*limits: tuple[float, float, float, float]) -> str:
    names = ("azimuth_min_deg", "azimuth_max_deg", "elevation_min_deg", "elevation_max_deg")
    items = [
        ", ".join(f"{name}: {value}" for name, value in zip(names, each, strict=True)) for each in limits
    ]
    return f"sensors.range_bearing.sectors=[{', '.join(f'{{{item}}}' for item in items)}]"


def test_elevation_by_hand() -> None:
    # The leader is pitched down by 20 deg and looks along +x: what lies ahead at its height is 20 deg up.
    # F1 is straight ahead; F2 is 45 deg below the horizon behind it: from there -45 - 20 deg.
    level = {"pitch_deg": 0.0, "roll_deg": 0.0}
    states = [
        odometry(0, (1.0, 2.0, 5.0), 0.0, pitch_deg=20.0, roll_deg=0.0),
        odometry(0, (4.0, 2.0, 5.0), 77.0, **level),
        odometry(0, (-1.0, 2.0, 3.0), -130.0, **level),
    ]
    found = np.degrees(view_margins(log_of(states)))
    assert found.shape == (1, 3, 3)
    assert found[0, 0, 1] == pytest.approx(60.0 - 20.0)
    assert found[0, 0, 2] == pytest.approx(60.0 - 65.0)
    assert found[0, 2, 0] == pytest.approx(60.0 - 45.0)  # it sees the leader 45 deg up, whatever its yaw
    assert np.isnan(found[0].diagonal()).all()


def test_azimuth_by_hand() -> None:
    # F1 is 30 deg to the left of where the leader looks, F2 170 deg to the right.
    bearings = {name: np.radians(angle) for name, angle in zip(FOLLOWERS, (30.0, -170.0), strict=True)}
    states = [odometry(0, (0.0, 0.0, 4.0), 0.0, pitch_deg=0.0, roll_deg=0.0)] + [
        odometry(0, (3.0 * np.cos(a), 3.0 * np.sin(a), 4.0), 12.0) for a in bearings.values()
    ]
    ahead, behind = (-50.0, 40.0, -60.0, 60.0), (160.0, -165.0, -60.0, 60.0)
    for limits, expected in (
        ([ahead], (10.0, -120.0)),
        ([behind], (-130.0, 5.0)),
        ([ahead, behind], (10.0, 5.0)),
        ([(-180.0, 180.0, -60.0, 8.0)], (8.0, 8.0)),
    ):
        found = np.degrees(view_margins(log_of(states, sectors(*limits))))
        np.testing.assert_allclose(found[0, 0, 1:], expected, atol=1e-9)


def test_the_sensor_sees_what_has_a_margin() -> None:
    generator = np.random.default_rng(8)
    limits = sectors((-100.0, 35.0, -30.0, 55.0), (150.0, -140.0, -70.0, 10.0))
    seen_of = {True: 0, False: 0}
    for seed in range(60):
        angles = generator.uniform(-1.0, 1.0, (3, 3)) * [180.0, 40.0, 40.0]
        places = generator.uniform(-2.0, 2.0, (3, 3)) + [0.0, 0.0, 5.0]
        states = [odometry(0, places[i], *angles[i]) for i in range(3)]
        log = log_of(states, limits)
        config = log.scenario.config.sensors.range_bearing
        sensor = RangeBearingSensor(config, np.random.default_rng(seed), "leader", FOLLOWERS, ())
        truth = dict(zip(("leader", *FOLLOWERS), states, strict=True))
        by_target = sensor.read(truth).by_target
        margins = view_margins(log)[0, 0, 1:]
        for name, margin in zip(FOLLOWERS, margins, strict=True):
            seen_of[margin > 0.0] += 1
            assert (name in by_target) == (margin > 0.0)
    assert min(seen_of.values()) > 20


def test_attitude_counts_in_full() -> None:
    attitude = Rotation.from_euler("ZYX", [40.0, 25.0, -15.0], degrees=True)
    place = np.array([1.0, -2.0, 4.0]) + attitude.apply([np.cos(0.3), 0.0, np.sin(0.3)])
    states = [
        odometry(0, (1.0, -2.0, 4.0), 40.0, pitch_deg=25.0, roll_deg=-15.0),
        odometry(0, place, 10.0),
        odometry(0, (9.0, 9.0, 4.0), 10.0),
    ]
    assert view_margins(log_of(states))[0, 0, 1] == pytest.approx(np.radians(60.0) - 0.3)
