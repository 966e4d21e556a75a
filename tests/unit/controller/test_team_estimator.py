"""The team estimator over recorded measurements: start, late and lost messages, and what it must not use."""

import dataclasses
from collections.abc import Callable, Iterator

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from relform_controller.estimation.estimator import AppliedInputs, TeamEstimate, Waiting
from relform_controller.estimation.team import TeamEstimator
from relform_controller.estimation.team_monitor import RUN
from relform_controller.formation_controller import FormationController
from relform_controller.ocp import layout
from relform_controller.ocp.frames import wrap_angle, wrap_angles
from relform_controller.ocp.layout import ordered_pairs
from relform_controller.ocp.rotor_lag import RotorLag
from relform_core.load import LoadedScenario
from relform_core.measurements import TeamMeasurements, VehicleMeasurements
from relform_core.names import EstimatorMode
from relform_core.scenario_config import ScenarioConfig
from relform_core.sensors.imu import IMU
from relform_core.sensors.localization import LOCALIZATION
from relform_core.sensors.range_bearing import RANGE_BEARING, RangeBearing
from relform_core.telemetry import Decision
from support.flights import AGILE, all_speeds, decided, record, replaced
from support.scenarios import paper_scenario


@dataclasses.dataclass(frozen=True)
class Flight:
    """Measurements and decisions of a flight with raw feedback."""

    measured: list[TeamMeasurements]
    decided: list[Decision]


SCENARIO = paper_scenario(AGILE, seed=3)
WITH_LAG = paper_scenario(AGILE, "vehicle.rotor_time_constant_s=0.04", seed=3)
STEPS = 30
FOLLOWER = "follower_1"


@pytest.fixture(scope="module")
def flight() -> Flight:
    return Flight(*record(SCENARIO, STEPS))


def estimates(
    flight: Flight, measured: list[TeamMeasurements], config: ScenarioConfig = SCENARIO.config
) -> list[TeamEstimate | Waiting]:
    """Estimates on these measurements, with the inputs that were applied in the recorded flight."""
    estimator = TeamEstimator(config)
    coefficient = SCENARIO.config.vehicle.thrust_coefficient
    hover = np.full((3, 4), SCENARIO.config.vehicle.hover_thrust)
    found, thrusts = [], hover
    for measurements, decision in zip(measured, flight.decided, strict=False):
        before_ns = measurements.arrival_ns - SCENARIO.config.period_ns
        inputs = AppliedInputs(thrusts, np.zeros((3, 4)))
        found.append(estimator.update(measurements, {before_ns: inputs}, None))
        thrusts = coefficient * np.array([c.speeds for c in decision.commands.values()]) ** 2
    return found


def last(
    flight: Flight, measured: list[TeamMeasurements], config: ScenarioConfig = SCENARIO.config
) -> TeamEstimate:
    estimate = estimates(flight, measured, config)[-1]
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


@pytest.mark.parametrize("scenario", [SCENARIO, WITH_LAG], ids=["no_lag", "lag"])
def test_late_measurements_are_used_at_their_own_instants(flight: Flight, scenario: LoadedScenario) -> None:
    """Range and bearing of one follower arrives three steps late, but all before the last step."""

    def is_late(sent: int, vehicle: str, sensor: str) -> bool:
        return vehicle == FOLLOWER and sensor == RANGE_BEARING.name and 5 <= sent < STEPS - 5

    late = list(delayed(flight.measured, is_late, 3))
    assert_equal(last(flight, late, scenario.config), last(flight, flight.measured, scenario.config))


def test_the_lag_of_the_rotors_is_found_if_it_is_not_known() -> None:
    """What is found before is taken for other forces at first."""
    flown = Flight(*record(WITH_LAG, STEPS))
    known, unknown = (estimates(flown, flown.measured, each.config) for each in (WITH_LAG, SCENARIO))
    lags = [
        [each.rotor_lag for each in found if isinstance(each, TeamEstimate)] for found in (known, unknown)
    ]
    assert lags[0] == [RotorLag(0.04)] * STEPS
    assert (lags[1][0], lags[1][-1]) == (RotorLag(0.0), RotorLag(0.04))
    (changed,) = (step for step in range(1, STEPS) if lags[1][step] != lags[1][step - 1])
    reported = unknown[changed]
    assert isinstance(reported, TeamEstimate)
    assert "rotors lag by 0.04 s, not 0.0 s" in reported.report.reason


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


def with_sightings(
    measurements: TeamMeasurements, observer: str, change: Callable[[RangeBearing], RangeBearing]
) -> TeamMeasurements:
    bearings = measurements.by_vehicle[observer].newest(RANGE_BEARING)
    assert bearings is not None
    by_target = {target: change(seen) for target, seen in bearings.by_target.items()}
    return replaced(measurements, observer, range_bearing=dataclasses.replace(bearings, by_target=by_target))


def test_a_vehicle_about_which_the_belief_is_wrong_is_placed_again(flight: Flight) -> None:
    """At the start, a follower sees the others as if it had turned by 1.9 rad to the left."""

    def turned(seen: RangeBearing) -> RangeBearing:
        return dataclasses.replace(seen, azimuth=wrap_angle(seen.azimuth - 1.9))

    measured = [with_sightings(flight.measured[0], FOLLOWER, turned), *flight.measured[1:]]
    found = [each for each in estimates(flight, measured) if isinstance(each, TeamEstimate)]
    whole = [each for each in estimates(flight, flight.measured) if isinstance(each, TeamEstimate)]
    turns = [
        wrap_angles(a.geometry.yaw_I1I2 - b.geometry.yaw_I1I2) for a, b in zip(found, whole, strict=True)
    ]
    followers = [(i == 1, j == 1) for i, j in ordered_pairs(3)]
    expected = [1.9 * (is_target - is_observer) for is_observer, is_target in followers]
    np.testing.assert_allclose(turns[5], expected, atol=0.2)
    assert found[5].report.rejected == (
        "range and bearing from follower_1 to leader",
        "range and bearing from follower_1 to follower_2",
    )
    placed = [k for k, each in enumerate(found) if "follower_1 was placed again" in each.report.reason]
    assert len(placed) == 1
    assert found[placed[0]].report.mode is EstimatorMode.DEGRADED
    assert not found[-1].report.rejected
    np.testing.assert_allclose(turns[-1], 0.0, atol=0.05)
    np.testing.assert_allclose(found[-1].geometry.p_I1I2_I1, whole[-1].geometry.p_I1I2_I1, atol=0.03)


def test_a_vehicle_with_a_broken_camera_is_not_placed_again(flight: Flight) -> None:
    """What contradicts the belief in a new way each time does not prove it wrong."""
    generator = np.random.default_rng(8)

    def broken(seen: RangeBearing) -> RangeBearing:
        return dataclasses.replace(seen, azimuth=generator.uniform(-np.pi, np.pi))

    measured = [
        *flight.measured[:8],
        *(with_sightings(each, FOLLOWER, broken) for each in flight.measured[8:]),
    ]
    found = [each for each in estimates(flight, measured) if isinstance(each, TeamEstimate)]
    assert all("placed" not in each.report.reason for each in found)
    off = found[-1].geometry.yaw_I1I2 - last(flight, flight.measured).geometry.yaw_I1I2
    np.testing.assert_allclose(wrap_angles(off), 0.0, atol=0.1)


def test_a_jump_of_the_localization_moves_the_team_as_a_whole(flight: Flight) -> None:
    jump = np.array([0.4, -0.7, 0.0])  # the sonars know the height

    def jumped(measurements: TeamMeasurements) -> TeamMeasurements:
        fix = measurements.by_vehicle["leader"].newest(LOCALIZATION)
        assert fix is not None
        return replaced(
            measurements, "leader", localization=dataclasses.replace(fix, p_NB_N=fix.p_NB_N + jump)
        )

    measured = [*flight.measured[:12], *map(jumped, flight.measured[12:])]
    found = [each for each in estimates(flight, measured) if isinstance(each, TeamEstimate)]
    reasons = [each.report.reason for each in found]
    assert reasons[12 : 12 + RUN - 1] == ["localization of leader does not fit"] * (RUN - 1)
    assert reasons[12 + RUN - 1 :] == ["localization of leader has jumped", *[""] * (len(reasons) - 12 - RUN)]
    whole = last(flight, flight.measured).geometry
    np.testing.assert_allclose(found[-1].geometry.p_NI_N - whole.p_NI_N, jump, atol=0.06)
    np.testing.assert_allclose(found[-1].geometry.p_I1I2_I1, whole.p_I1I2_I1, atol=0.01)


def test_innovations_are_reported(flight: Flight) -> None:
    found = estimates(flight, flight.measured)
    reports = [each.report for each in found if isinstance(each, TeamEstimate)]
    assert {report.nis_dof for report in reports} == {3 * len(ordered_pairs(3))}
    # Loose: the mean of 30 sums of 18 squares.
    assert chi2.ppf(0.001, 30 * 18) / 30 < np.mean([report.nis for report in reports]) < 22.0


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


def test_torques_that_the_model_does_not_explain_are_followed(flight: Flight) -> None:
    """The vehicles fly as recorded, but the filter is told of torques that they never had."""
    estimator = TeamEstimator(SCENARIO.config)
    coefficient = SCENARIO.config.vehicle.thrust_coefficient
    wrong: dict[int, AppliedInputs] = {}
    rates = []
    for measurements, decision in zip(flight.measured, flight.decided, strict=True):
        estimate = estimator.update(measurements, wrong, None)
        thrusts = coefficient * np.array([c.speeds for c in decision.commands.values()]) ** 2
        thrusts = thrusts + [0.05, 0.0, -0.05, 0.0]  # 2.6 rad/s^2 of pitch
        wrong = {measurements.arrival_ns: AppliedInputs(thrusts, np.zeros((3, 4)))}
        if isinstance(estimate, TeamEstimate):
            rates.append(estimate.states[:, layout.RATE])
    right = last(flight, flight.measured).states[:, layout.RATE]
    np.testing.assert_allclose(rates[-1], right, atol=0.15)


def test_doubt_about_the_inputs_makes_the_belief_less_certain(flight: Flight) -> None:
    """The rate about y may be off by the torque in doubt: half the difference is one standard deviation."""
    vehicle = SCENARIO.config.vehicle
    silent = dataclasses.replace(
        flight.measured[1], by_vehicle=dict.fromkeys(SCENARIO.config.team.vehicles, VehicleMeasurements({}))
    )
    variances = []
    doubt = np.zeros((3, 4))
    for difference in (0.0, 0.04):
        doubt[1] = [-difference, 0.0, difference, 0.0]
        estimator = TeamEstimator(SCENARIO.config)
        estimator.update(flight.measured[0], {}, None)
        estimator.update(silent, {0: AppliedInputs(np.full((3, 4), vehicle.hover_thrust), doubt)}, None)
        assert estimator.belief is not None
        variances.append(np.diag(estimator.belief.covariance).reshape(3, -1)[:, 10])
    rate = vehicle.arm_length * 2.0 * 0.04 / vehicle.inertia[1] * SCENARIO.config.controller.period
    added = variances[1] - variances[0]
    assert np.sqrt(added[1]) == pytest.approx(0.5 * rate, rel=0.05)
    assert np.abs(added[[0, 2]]).max() < 1e-12
