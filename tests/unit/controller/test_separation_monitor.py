"""Distances of a team by estimate, by ranges and by plan, and the level that follows."""

import math
from collections.abc import Mapping

import numpy as np
import pytest

from relform_controller.alarms import Alarms
from relform_controller.ocp import layout
from relform_controller.ocp.problem import TeamGeometry
from relform_controller.separation_monitor import SeparationMonitor
from relform_core.measurements import TeamMeasurements, VehicleMeasurements
from relform_core.names import SeparationLevel
from relform_core.sensors.range_bearing import RANGE_BEARING, RangeBearing, RangeBearings
from relform_core.separation_config import SeparationConfig
from relform_core.telemetry import Alarm, Nearest

VEHICLES = ("leader", "f1", "f2")
YAWS = np.array([0.4, -1.1, 2.0])
N_STAGES = 4
STAGE = 0.1


def geometry(places_N: np.ndarray) -> TeamGeometry:
    """Where the frames lie of vehicles at these places in the world, shape (vehicle, 3)."""

    def turned(yaw: float, vector: np.ndarray) -> np.ndarray:
        c, s = math.cos(yaw), math.sin(yaw)
        return np.array([c * vector[0] + s * vector[1], c * vector[1] - s * vector[0], vector[2]])

    pairs = layout.ordered_pairs(len(places_N))
    return TeamGeometry(
        np.array([turned(YAWS[i], places_N[j] - places_N[i]) for i, j in pairs]),
        np.array([YAWS[j] - YAWS[i] for i, j in pairs]),
        places_N[0],
        YAWS[0],
    )


def ranges(step: int, seen: Mapping[tuple[str, str], float]) -> TeamMeasurements:
    stamp_ns = step * 50_000_000
    by_vehicle = {}
    for name in VEHICLES:
        targets = {
            target: RangeBearing(target, distance, 0.1, 0.2, np.eye(3))
            for (observer, target), distance in seen.items()
            if observer == name
        }
        by_vehicle[name] = VehicleMeasurements.collect([(RANGE_BEARING, RangeBearings(stamp_ns, targets))])
    return TeamMeasurements(step, stamp_ns, by_vehicle)


PLACES = np.array([[1.0, 2.0, 3.0], [1.0, 3.5, 3.0], [1.0, 3.5, 1.8]])
"""Distances 1.5, 1.92 and 1.2 m."""
STILL = np.zeros((3, N_STAGES + 1, layout.N_STATE))


def monitor() -> SeparationMonitor:
    return SeparationMonitor(VEHICLES, SeparationConfig(warning_m=0.9, emergency_m=0.7), STAGE)


def test_nearest_by_the_estimate() -> None:
    report = monitor().update(ranges(0, {}), geometry(PLACES), geometry(PLACES), STILL)
    assert report.level is SeparationLevel.OK
    assert report.estimated == Nearest(("f1", "f2"), pytest.approx(1.2))
    assert report.predicted == Nearest(("f1", "f2"), pytest.approx(1.2))
    assert (report.predicted_in, report.measured) == (0.0, None)
    assert str(report) == "f1 and f2 are 1.20 m apart"


def test_the_plan_warns_of_what_is_to_come() -> None:
    """Leader and f1 move towards each other by 0.2 m per stage each, in their own frames."""
    states = STILL.copy()
    for vehicle, direction in ((0, 1.0), (1, -1.0)):
        way = 0.2 * np.array([0.0, 1.0, 1.0, 1.0, 1.0]).cumsum() * direction
        states[vehicle, :, 0] = math.sin(YAWS[vehicle]) * way
        states[vehicle, :, 1] = math.cos(YAWS[vehicle]) * way
    states[:, 3:] = states[:, 1:2]  # and apart again
    report = monitor().update(ranges(0, {}), geometry(PLACES), geometry(PLACES), states)
    assert report.predicted == Nearest(("leader", "f1"), pytest.approx(0.7))
    assert report.predicted_in == pytest.approx(2 * STAGE)
    assert report.level is SeparationLevel.WARNING
    assert report.estimated.distance == pytest.approx(1.2)


def test_one_range_may_be_an_outlier_and_two_are_believed() -> None:
    watch = monitor()

    def level(step: int, seen: Mapping[tuple[str, str], float]) -> SeparationLevel:
        return watch.update(ranges(step, seen), geometry(PLACES), geometry(PLACES), STILL).level

    assert level(0, {("f1", "f2"): 0.5, ("f2", "f1"): 1.2}) is SeparationLevel.OK
    assert level(1, {("f1", "f2"): 1.2, ("f2", "f1"): 1.2}) is SeparationLevel.OK
    assert level(2, {("f1", "f2"): 0.65, ("f2", "f1"): 0.66}) is SeparationLevel.EMERGENCY
    report = watch.update(ranges(3, {("f2", "f1"): 0.85}), geometry(PLACES), geometry(PLACES), STILL)
    assert report.measured == Nearest(("f1", "f2"), 0.66)  # of the step before
    report = watch.update(ranges(4, {("f1", "f2"): 0.86}), geometry(PLACES), geometry(PLACES), STILL)
    assert (report.measured, report.level) == (Nearest(("f1", "f2"), 0.86), SeparationLevel.WARNING)
    assert str(report) == "f1 and f2 are 0.86 m apart"


def test_an_alarm_is_said_once_until_its_cause_was_gone_for_a_second() -> None:
    alarms, said = Alarms(), []
    causes_of_steps = [{}, {"a": "1"}, {"a": "2", "b": "x"}, {}, {"a": "3"}, *[{}] * 20, {"a": "4"}]
    for step, causes in enumerate(causes_of_steps):
        said += [(step, alarm) for alarm in alarms.begin(step * 50_000_000, causes)]
    assert said == [(1, Alarm("a", "1")), (2, Alarm("b", "x")), (25, Alarm("a", "4"))]
