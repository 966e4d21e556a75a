"""The compiled team filter against the same filter in NumPy: on random beliefs, and in the estimator."""

import dataclasses
from collections.abc import Callable
from itertools import islice

import numpy as np
import pytest

from relform_analysis.flight.simulate import simulate
from relform_controller.estimation import team_model
from relform_controller.estimation.estimator import AppliedInputs, TeamEstimate
from relform_controller.estimation.team import TeamEstimator
from relform_controller.estimation.team_belief import Belief, Observation
from relform_controller.estimation.team_filter import ReferenceTeamFilter, TeamFilter
from relform_controller.estimation.team_kernel import CompiledTeamFilter, make_team_filter
from relform_controller.ocp import layout
from relform_controller.ocp.model import RigidBody
from relform_core.measurements import TeamMeasurements, VehicleMeasurements
from relform_core.sensors.imu import IMU
from relform_core.sensors.localization import LOCALIZATION
from relform_core.sensors.optic_flow import OPTIC_FLOW
from relform_core.sensors.range_bearing import RANGE_BEARING
from relform_core.sensors.sensor import Source
from support.flights import AGILE, replaced
from support.scenarios import paper_scenario

SCENARIO = paper_scenario(AGILE, "controller=team", seed=4)
BODY = RigidBody.from_config(paper_scenario("vehicle.drag_coefficient_n_s_m=[0.3, 0.2, 0.1]").config.vehicle)
STEPS = 30


def random_problem(n: int) -> tuple[Belief, np.ndarray, Observation]:
    """A belief, thrusts, and an observation in which some things are not measured."""
    generator = np.random.default_rng(n)
    size, n_pairs = n * team_model.N_FILTER_STATE, n * (n - 1)
    states = generator.uniform(-0.4, 0.4, (n, team_model.N_FILTER_STATE))
    states[:, layout.POSITION] += generator.uniform(-9.0, 9.0, (n, 3))
    states[:, layout.YAW] = generator.uniform(-3.1, 3.1, n)
    states[:, team_model.THRUST_SCALE] = generator.uniform(0.9, 1.1, n)
    states[:, team_model.INERTIA_SCALE] = generator.uniform(0.9, 1.1, (n, 3))
    root = 0.1 * np.tril(generator.standard_normal((size, size)), -1)
    root += np.diag(generator.uniform(0.1, 1.0, size))
    own_weights = generator.uniform(0.5, 9.0, (n, team_model.N_OWN_ROWS))
    own_weights[generator.random(own_weights.shape) < 0.3] = 0.0
    sighting_weights = generator.standard_normal((n_pairs, 3, 3))
    sighting_weights[generator.random(n_pairs) < 0.3] = 0.0
    observation = Observation(
        generator.uniform(-3.0, 3.0, own_weights.shape),
        own_weights,
        generator.uniform(-3.0, 3.0, (n_pairs, 3)),
        sighting_weights,
    )
    return Belief(states, root), generator.uniform(1.2, 2.4, (n, layout.N_INPUT)), observation


def assert_same(found: object, expected: object) -> None:
    """Both have the same numbers, up to rounding."""
    if isinstance(expected, np.ndarray | float):
        scale = max(1e-3, float(np.abs(expected).max()))
        np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-10 * scale)
    elif isinstance(expected, tuple):
        for one, other in zip(found, expected, strict=True):  # type: ignore[call-overload]
            assert_same(one, other)
    else:
        assert dataclasses.is_dataclass(expected)
        for field in dataclasses.fields(expected):
            assert_same(getattr(found, field.name), getattr(expected, field.name))


@pytest.mark.parametrize("n", [2, 3, 5, 8])
def test_one_step_of_the_filter(n: int) -> None:
    kernel, reference = CompiledTeamFilter(BODY, n), ReferenceTeamFilter(BODY, n)
    belief, thrusts, observation = random_problem(n)
    noise = np.random.default_rng(9).uniform(1e-4, 1e-2, belief.states.shape)
    expected = reference.predict(belief, thrusts, 0.05, noise)
    assert_same(kernel.predict(belief, thrusts, 0.05, noise), expected)
    innovation = kernel.innovation(belief, thrusts, observation)
    assert_same(innovation, reference.innovation(belief, thrusts, observation))
    rejected = np.random.default_rng(10).random(n * (n - 1)) < 0.4
    for each in (innovation, innovation.without(rejected)):
        corrected = reference.correct(belief, each)
        assert_same(kernel.correct(belief, each), corrected)
    assert_same(kernel.geometry(corrected), reference.geometry(corrected))


def test_a_covariance_that_is_not_definite_is_an_error() -> None:
    belief, thrusts, _ = random_problem(2)
    noise = np.full(belief.states.shape, -100.0)
    for each in (CompiledTeamFilter(BODY, 2), ReferenceTeamFilter(BODY, 2)):
        with pytest.raises(np.linalg.LinAlgError, match="covariance of the team is not positive"):
            each.predict(belief, thrusts, 0.05, noise)


def test_without_a_compiler_there_is_a_warning_and_the_reference(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", "")
    monkeypatch.delenv("CC", raising=False)
    heavier = dataclasses.replace(BODY, mass=BODY.mass + 0.01)  # not compiled before in this process
    with pytest.warns(RuntimeWarning, match="no C compiler found") as caught:
        found = make_team_filter(heavier, 2)
    assert len(caught) == 1
    assert isinstance(found, ReferenceTeamFilter)


Change = Callable[[int, TeamMeasurements], TeamMeasurements]


def unchanged(step: int, measurements: TeamMeasurements) -> TeamMeasurements:
    return measurements


def outliers(step: int, measurements: TeamMeasurements) -> TeamMeasurements:
    """Each second step the leader sees everything 0.8 m too far away."""
    seen = measurements.by_vehicle["leader"].newest(RANGE_BEARING)
    if step % 2 or seen is None:
        return measurements
    by_target = {
        target: dataclasses.replace(each, range=each.range + 0.8) for target, each in seen.by_target.items()
    }
    return replaced(measurements, "leader", range_bearing=dataclasses.replace(seen, by_target=by_target))


def turned_start(step: int, measurements: TeamMeasurements) -> TeamMeasurements:
    """At the start a follower sees the others as if it had turned: it is placed again later."""
    seen = measurements.by_vehicle["follower_1"].newest(RANGE_BEARING)
    if step or seen is None:
        return measurements
    by_target = {
        target: dataclasses.replace(each, azimuth=each.azimuth - 1.9)
        for target, each in seen.by_target.items()
    }
    return replaced(measurements, "follower_1", range_bearing=dataclasses.replace(seen, by_target=by_target))


def jump(step: int, measurements: TeamMeasurements) -> TeamMeasurements:
    """The localization jumps."""
    fix = measurements.by_vehicle["leader"].newest(LOCALIZATION)
    if step < 8 or fix is None:
        return measurements
    return replaced(measurements, "leader", localization=dataclasses.replace(fix, p_NB_N=fix.p_NB_N - 0.6))


def gust(step: int, measurements: TeamMeasurements) -> TeamMeasurements:
    """An accelerometer and a gyro show forces and torques that the model does not know."""
    imu = measurements.by_vehicle["follower_2"].newest(IMU)
    if step < 10 or imu is None:
        return measurements
    changed = dataclasses.replace(imu, f_NB_B=imu.f_NB_B + [0.9, -0.6, 0.4], w_NB_B=imu.w_NB_B + 0.4)
    return replaced(measurements, "follower_2", imu=changed)


def missing(step: int, measurements: TeamMeasurements) -> TeamMeasurements:
    """A sensor after the other is silent, then a whole vehicle."""
    sensors: list[Source] = [IMU, OPTIC_FLOW, RANGE_BEARING]
    if step >= 20:
        silent = {**measurements.by_vehicle, "follower_1": VehicleMeasurements({})}
        return dataclasses.replace(measurements, by_vehicle=silent)
    return replaced(measurements, "follower_2", **{sensors[step % 3].name: None}) if step else measurements


def late(measured: list[TeamMeasurements]) -> list[TeamMeasurements]:
    """All that a follower measures arrives two steps late, after the start."""
    arrived = []
    for step, measurements in enumerate(measured):
        sent = step if step == 0 else step - 2
        its = measured[sent].by_vehicle["follower_1"] if sent >= 0 else VehicleMeasurements({})
        arrived.append(
            dataclasses.replace(measurements, by_vehicle={**measurements.by_vehicle, "follower_1": its})
        )
    return arrived


@pytest.fixture(scope="module")
def flown() -> tuple[list[TeamMeasurements], list[np.ndarray]]:
    """Measurements of a flight, and the thrusts that were commanded after each."""
    steps = list(islice(simulate(SCENARIO), STEPS))
    hover = np.full((3, 4), SCENARIO.config.vehicle.hover_thrust)
    speeds = [
        np.array([command.speeds for command in step.decision.commands.values()]) if step.decision else None
        for step in steps
    ]
    coefficient = SCENARIO.config.vehicle.thrust_coefficient
    thrusts = [hover if each is None else coefficient * each**2 for each in speeds]
    return [step.measurements for step in steps], thrusts


def estimated(
    team_filter: TeamFilter, measured: list[TeamMeasurements], thrusts: list[np.ndarray], inertia: bool
) -> list[TeamEstimate]:
    """Estimates; in one interval of ten it is not known whether a follower flew its commands."""
    set_value = f"controller.estimator.estimates_inertia={str(inertia).lower()}"
    config = paper_scenario(AGILE, "controller=team", set_value, seed=4).config
    estimator = TeamEstimator(config, team_filter)
    applied: dict[int, AppliedInputs] = {}
    found = []
    for step, (measurements, each) in enumerate(zip(measured, thrusts, strict=True)):
        estimate = estimator.update(measurements, applied, None)
        doubt = np.zeros((3, 4))
        doubt[1, 2] = 0.1 * (step % 10 == 5)
        applied = {measurements.arrival_ns: AppliedInputs(each, doubt)}
        if isinstance(estimate, TeamEstimate):
            found.append(estimate)
    return found


@pytest.mark.parametrize("inertia", [True, False], ids=["inertia", "nominal"])
@pytest.mark.parametrize("change", [unchanged, outliers, turned_start, jump, gust, missing, late])
def test_estimates_are_the_same(
    flown: tuple[list[TeamMeasurements], list[np.ndarray]], change: object, inertia: bool
) -> None:
    measured, thrusts = flown
    if change is late:
        measured = late(measured)
    else:
        measured = [change(step, each) for step, each in enumerate(measured)]  # type: ignore[operator]
    body = RigidBody.from_config(SCENARIO.config.vehicle)
    found, expected = (
        estimated(each, measured, thrusts, inertia)
        for each in (CompiledTeamFilter(body, 3), ReferenceTeamFilter(body, 3))
    )
    assert len(found) == len(expected) > STEPS - 5
    for one, other in zip(found, expected, strict=True):
        assert (one.report.mode, one.report.reason) == (other.report.mode, other.report.reason)
        assert (one.report.rejected, one.report.nis_dof) == (other.report.rejected, other.report.nis_dof)
        np.testing.assert_allclose(one.report.nis, other.report.nis, rtol=1e-6)
        np.testing.assert_allclose(one.states, other.states, atol=1e-9)
        np.testing.assert_allclose(one.geometry.p_I1I2_I1, other.geometry.p_I1I2_I1, atol=1e-9)
        np.testing.assert_allclose(one.yaw_variances, other.yaw_variances, rtol=1e-6)
