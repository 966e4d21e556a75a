"""The team estimator over recorded measurements: start, late and lost messages, and what it must not use."""

import dataclasses
from collections.abc import Callable, Iterator

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from relform_controller.estimation.estimator import TeamEstimate, Waiting
from relform_controller.estimation.team import TeamEstimator
from relform_controller.formation_controller import FormationController
from relform_core.measurements import TeamMeasurements, VehicleMeasurements
from relform_core.names import EstimatorMode
from relform_core.sensors.imu import IMU
from relform_core.sensors.range_bearing import RANGE_BEARING
from relform_core.telemetry import Decision
from support.flights import AGILE, all_speeds, decided, record, replaced
from support.scenarios import paper_scenario


@dataclasses.dataclass(frozen=True)
class Flight:
    """Measurements and decisions of a flight with raw feedback."""

    measured: list[TeamMeasurements]
    decided: list[Decision]


SCENARIO = paper_scenario(AGILE, seed=3)
STEPS = 30
FOLLOWER = "follower_1"


@pytest.fixture(scope="module")
def flight() -> Flight:
    return Flight(*record(SCENARIO, STEPS))


def estimates(flight: Flight, measured: list[TeamMeasurements]) -> list[TeamEstimate | Waiting]:
    """Estimates on these measurements, with the inputs that were applied in the recorded flight."""
    estimator = TeamEstimator(SCENARIO.config)
    coefficient = SCENARIO.config.vehicle.thrust_coefficient
    hover = np.full((3, 4), SCENARIO.config.vehicle.hover_thrust)
    found, thrusts = [], hover
    for measurements, decision in zip(measured, flight.decided, strict=False):
        before_ns = measurements.arrival_ns - SCENARIO.config.period_ns
        found.append(estimator.update(measurements, {before_ns: thrusts}, None))
        thrusts = coefficient * np.array([c.speeds for c in decision.commands.values()]) ** 2
    return found


def last(flight: Flight, measured: list[TeamMeasurements]) -> TeamEstimate:
    estimate = estimates(flight, measured)[-1]
    assert isinstance(estimate, TeamEstimate)
    return estimate


def assert_equal(one: TeamEstimate, other: TeamEstimate) -> None:
    np.testing.assert_allclose(one.states, other.states, atol=1e-9)
    np.testing.assert_allclose(one.geometry.p_I1I2_I1, other.geometry.p_I1I2_I1, atol=1e-9)
    np.testing.assert_allclose(one.geometry.yaw_I1I2, other.geometry.yaw_I1I2, atol=1e-9)
    np.testing.assert_allclose(one.yaw_variances, other.yaw_variances, rtol=1e-6)


def delayed(
    measured: list[TeamMeasurements], is_late: Callable[[int, str, str], bool], steps: int
) -> Iterator[TeamMeasurements]:
    """The same measurements with their own stamps, some of which arrive some steps later."""
    for step, measurements in enumerate(measured):
        by_vehicle = {}
        for vehicle in measurements.by_vehicle:
            by_sensor = {}
            for sent in (step, step - steps):
                if sent >= 0:
                    for sensor, each in measured[sent].by_vehicle[vehicle].by_sensor.items():
                        if is_late(sent, vehicle, sensor) == (sent != step):
                            by_sensor[sensor] = (*each, *by_sensor.get(sensor, ()))
            by_vehicle[vehicle] = VehicleMeasurements(by_sensor)
        yield dataclasses.replace(measurements, by_vehicle=by_vehicle)


def test_late_measurements_are_used_at_their_own_instants(flight: Flight) -> None:
    """Range and bearing of one follower arrives three steps late, but all before the last step."""

    def is_late(sent: int, vehicle: str, sensor: str) -> bool:
        return vehicle == FOLLOWER and sensor == RANGE_BEARING.name and 5 <= sent < STEPS - 5

    assert_equal(last(flight, list(delayed(flight.measured, is_late, 3))), last(flight, flight.measured))


def test_a_late_measurement_changes_the_estimate(flight: Flight) -> None:
    lost = [replaced(each, FOLLOWER, range_bearing=None) for each in flight.measured[5:12]]
    measured = [*flight.measured[:5], *lost, *flight.measured[12:]]
    states, others = last(flight, measured).states, last(flight, flight.measured).states
    assert np.abs(states - others).max() > 1e-6


def test_followers_have_no_compass(flight: Flight) -> None:
    """Another yaw offset of a follower's IMU changes nothing."""

    def turned(measurements: TeamMeasurements) -> TeamMeasurements:
        imu = measurements.by_vehicle[FOLLOWER].newest(IMU)
        assert imu is not None
        q_NB = (Rotation.from_euler("z", 1.9) * Rotation.from_quat(imu.q_NB)).as_quat()
        return replaced(measurements, FOLLOWER, imu=dataclasses.replace(imu, q_NB=q_NB))

    assert_equal(last(flight, [turned(each) for each in flight.measured]), last(flight, flight.measured))


def test_the_start_waits_until_all_vehicles_are_placed(flight: Flight) -> None:
    blind = [replaced(each, FOLLOWER, range_bearing=None) for each in flight.measured[:3]]
    found = estimates(flight, [*blind, *flight.measured[3:6]])
    assert [isinstance(each, Waiting) for each in found] == [True] * 3 + [False] * 3
    waiting = found[0]
    assert isinstance(waiting, Waiting)
    assert waiting.reason == "mutual range and bearing that connects follower_1 with leader"


def test_the_start_waits_for_the_leaders_localization(flight: Flight) -> None:
    waiting = estimates(flight, [replaced(flight.measured[0], "leader", localization=None)])[0]
    assert isinstance(waiting, Waiting)
    assert waiting.reason == "localization of leader"


def test_the_formation_does_not_depend_on_the_localization(flight: Flight) -> None:
    """Without localization the team's pose drifts; relative positions keep the accuracy of the sightings."""
    lost = [replaced(each, "leader", localization=None) for each in flight.measured[10:]]
    without, with_it = last(flight, [*flight.measured[:10], *lost]), last(flight, flight.measured)
    np.testing.assert_allclose(without.geometry.p_I1I2_I1, with_it.geometry.p_I1I2_I1, atol=0.02)


def test_an_outlier_is_ignored(flight: Flight) -> None:
    """One sighting is wrong by a metre."""
    sights = flight.measured[-1].by_vehicle["leader"].newest(RANGE_BEARING)
    assert sights is not None
    wrong = dataclasses.replace(sights.by_target[FOLLOWER], range=sights.by_target[FOLLOWER].range + 1.0)
    wrong_sights = dataclasses.replace(sights, by_target={**sights.by_target, FOLLOWER: wrong})
    measured = [
        *flight.measured[:-1],
        replaced(flight.measured[-1], "leader", range_bearing=wrong_sights),
    ]
    difference = last(flight, measured).geometry.p_I1I2_I1 - last(flight, flight.measured).geometry.p_I1I2_I1
    assert np.abs(difference).max() < 0.01


def test_a_lost_message_is_named(flight: Flight) -> None:
    whole = last(flight, flight.measured)
    assert (whole.report.mode, whole.report.reason, any(whole.yaw_held)) == (
        EstimatorMode.MEASURED,
        "",
        False,
    )
    lost = replaced(flight.measured[-1], FOLLOWER, range_bearing=None)
    partial = last(flight, [*flight.measured[:-1], lost])
    assert (partial.report.mode, partial.report.reason) == (
        EstimatorMode.PREDICTED,
        "range_bearing of follower_1",
    )
    pairs = [(i, j) for i in range(3) for j in range(3) if i != j]
    assert partial.yaw_held == tuple(1 in pair for pair in pairs)


def test_it_can_be_injected(flight: Flight) -> None:
    """Beside a configuration that names raw feedback; the prediction model then takes disturbances."""
    injected = FormationController(SCENARIO.config, estimator=TeamEstimator(SCENARIO.config))
    selected = FormationController(paper_scenario(AGILE, "controller.estimator=team", seed=3).config)
    for measurements in flight.measured[:5]:
        np.testing.assert_array_equal(
            all_speeds([decided(injected, measurements)]), all_speeds([decided(selected, measurements)])
        )
