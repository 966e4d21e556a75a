"""Scenarios with a soft constraint: the true motion holds it, and violates it without its price."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from relform_analysis.flight.log import FlightLog
from relform_analysis.flight.metrics import separation_min, tilts
from relform_analysis.flight.simulate import fly_in_process
from relform_core.load import load_scenario
from relform_core.obstacles import clearance

LENGTH, SPEED, ANGLE = 0.02, 0.02, math.radians(1.0)
"""How far the truth may lie beyond a bound that the plan holds: the state is estimated [m, m/s, rad]."""


def off_axis(log: FlightLog, observer: str, target: str) -> np.ndarray:
    """Angle between the axis of the field of view of an observer and its target [rad], at every instant."""
    view = log.scenario.config.controller.constraints.field_of_view
    i, j = log.vehicles.index(observer), log.vehicles.index(target)
    axis_B = Rotation.from_euler("zy", [view.axis_azimuth, -view.axis_elevation]).apply([1.0, 0.0, 0.0])
    axis_N = Rotation.from_quat(log.q_NB[:, i]).apply(axis_B)
    to_target = log.p_NB_N[:, j] - log.p_NB_N[:, i]
    return np.arctan2(np.linalg.norm(np.cross(axis_N, to_target), axis=1), (axis_N * to_target).sum(axis=1))


def excess(log: FlightLog) -> dict[str, float]:
    """How far the true motion goes beyond each bound of its scenario at worst [m, m/s, rad]."""
    config = log.scenario.config
    bounds, found = config.controller.constraints, {}
    if bounds.separation is not None:
        found["separation"] = bounds.separation.min - separation_min(log.p_NB_N)
    if bounds.tilt is not None:
        found["tilt"] = float(tilts(log.q_NB).max()) - bounds.tilt.max
    if bounds.speed is not None:
        found["speed"] = float(np.linalg.norm(log.v_NB_B, axis=-1).max()) - bounds.speed.max
    if bounds.keep_out is not None:
        found["keep_out"] = bounds.keep_out.margin - float(clearance(config.obstacles, log.p_NB_N).min())
    if (view := bounds.field_of_view) is not None:
        found["field_of_view"] = max(off_axis(log, *pair).max() for pair in view.pairs) - view.half_angle
    return found


def fly(scenario: str, seed: int, *free: str) -> FlightLog:
    """Fly a scenario with some of its constraints at no price."""
    overrides = [
        f"controller.constraints.{name}.{price}"
        for name in free
        for price in ("price_per_unit=1.0e-9", "square_price_per_unit2=0.0")
    ]
    return fly_in_process(load_scenario(scenario, overrides, seed))


@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.parametrize(
    ("scenario", "constraints"),
    [
        ("crossing", {"separation", "speed"}),
        ("gust", {"separation", "tilt"}),
        ("view", {"field_of_view"}),
        ("pillar", {"keep_out"}),
    ],
)
def test_constraints_hold(scenario: str, constraints: set[str], seed: int) -> None:
    log = fly(scenario, seed)
    assert not log.faults
    beyond, tolerance = excess(log), {"speed": SPEED, "tilt": ANGLE, "field_of_view": ANGLE}
    assert set(beyond) == constraints
    for name, value in beyond.items():
        assert value < tolerance.get(name, LENGTH), name
    config = log.scenario.config
    if config.controller.constraints.field_of_view is not None:
        apart = np.linalg.norm(log.p_NB_N[:, 1:] - log.p_NB_N[:, :1], axis=-1)
        assert apart.max() < config.controller.constraints.field_of_view.range_max


@pytest.mark.parametrize(
    ("scenario", "free", "beyond"),
    [
        ("crossing", "separation", 0.3),
        ("crossing", "speed", 0.4),
        ("gust", "separation", 0.15),
        ("gust", "tilt", math.radians(4.0)),
        ("view", "field_of_view", math.radians(5.0)),
        ("pillar", "keep_out", 0.25),
    ],
)
def test_without_its_price_a_constraint_is_violated(scenario: str, free: str, beyond: float) -> None:
    assert excess(fly(scenario, 0, free))[free] > beyond
