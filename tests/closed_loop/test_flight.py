"""Whole flights in one process: the controller on the simulated vehicles, judged by ground truth."""

import itertools
from functools import cache

import numpy as np
import numpy.typing as npt
import pytest
from scipy.spatial.transform import Rotation

from relform_analysis.flight.log import FlightLog
from relform_analysis.flight.simulate import fly_in_process
from relform_core.arrays import Array
from relform_core.load import LoadedScenario
from relform_core.units import rad_s_to_rpm
from support.flights import AGILE
from support.scenarios import NOISE_FREE, paper_scenario, team_of

PAPER_PAIRS = (("leader", "follower_1"), ("leader", "follower_2"), ("follower_2", "follower_1"))


@cache
def fly(*overrides: str, seed: int) -> FlightLog:
    return fly_in_process(paper_scenario(*overrides, seed=seed))


def places(log: FlightLog, scenario: LoadedScenario) -> Array:
    """Where the phases want every vehicle in {mc} of the leader [m], shape (step, vehicle, 3)."""
    config = scenario.config
    rows = []
    for phase in config.phases:
        formation = config.formations[phase.formation]
        row = [(0.0, 0.0, 0.0), *(formation[name] for name in config.team.followers)]
        rows += [row] * round(phase.duration / config.controller.period)
    return np.array(rows)[: len(log.tick_of_step)]


def formation_error(log: FlightLog, pairs: tuple[tuple[str, str], ...] = PAPER_PAIRS) -> Array:
    """How far the target is from its place in {mc} of the observer [m], shape (step, pair)."""
    place, names = places(log, log.scenario), log.vehicles
    p_NB_N = log.p_NB_N[log.tick_of_step]
    errors = []
    for observer, target in pairs:
        i, j = names.index(observer), names.index(target)
        yaw = Rotation.from_quat(log.q_NB[log.tick_of_step, i]).as_euler("ZYX")[:, 0]
        p_B1B2_C1 = Rotation.from_euler("z", -yaw[:, None]).apply(p_NB_N[:, j] - p_NB_N[:, i])
        errors.append(np.linalg.norm(p_B1B2_C1 - (place[:, j] - place[:, i]), axis=1))
    return np.array(errors).T


def steady(log: FlightLog) -> npt.NDArray[np.bool_]:
    """Control steps within the steady windows of the phases."""
    period, mask = log.scenario.config.controller.period, []
    for phase in log.scenario.config.phases:
        time = np.arange(round(phase.duration / period)) * period
        mask += (time >= phase.steady_from - 1e-9).tolist()
    return np.array(mask)[: len(log.tick_of_step)]


def leader_error(log: FlightLog) -> Array:
    return np.linalg.norm(log.p_NB_N[log.tick_of_step, 0] - log.leader_p_NB_N__ref, axis=1)


def assert_flown_to_the_end(log: FlightLog) -> None:
    assert log.faults == ()
    assert len(log.tick_of_step) == log.scenario.config.n_steps
    assert not (log.solver["status"] == 2).any()  # no fallback
    rpm = rad_s_to_rpm(1.0) * log.rotor_speeds
    assert rpm.min() >= 1200.0 - 1e-6
    assert rpm.max() <= 6000.0 + 1e-6


def test_the_papers_scenario() -> None:
    log = fly(seed=1)
    assert_flown_to_the_end(log)
    error = formation_error(log)[steady(log)]
    assert error.mean() <= 0.075
    assert np.percentile(error, 95) < 0.15
    assert (error.mean(axis=0) < 0.085).all()  # each pair
    assert leader_error(log)[steady(log)].mean() < 0.15


def test_the_papers_scenario_without_noise() -> None:
    log = fly(*NOISE_FREE, seed=3)
    assert_flown_to_the_end(log)
    error = formation_error(log)[steady(log)]
    assert error.mean() < 0.003
    assert leader_error(log)[steady(log)].mean() < 0.05


def test_the_yaw_follows_the_heading_of_the_leader_and_the_followers_that_of_the_leader() -> None:
    log = fly(*NOISE_FREE, seed=3)
    yaws = Rotation.from_quat(log.q_NB[log.tick_of_step].reshape(-1, 4)).as_euler("ZYX")[:, 0].reshape(-1, 3)
    error = np.exp(1j * (yaws - log.leader_yaw__ref[:, None]))[steady(log)]
    assert np.degrees(np.abs(np.angle(error))).mean() < 5.0


HOVER_AND_LINE = (
    "phases=["
    "{name: P, title: hover, duration_s: 2.0, steady_from_s: 1.0, formation: initial, "
    "motion: {kind: hover, ramp_s: 0.0}}, "
    "{name: Q, title: line, duration_s: 4.0, steady_from_s: 2.0, formation: initial, "
    "motion: {kind: straight, speed_m_s: 1.0, ramp_s: 1.5}}]"
)


@pytest.mark.parametrize("n_vehicles", [2, 5])
def test_teams_of_other_sizes(n_vehicles: int) -> None:
    log = fly(*team_of(n_vehicles), HOVER_AND_LINE, seed=2)
    assert_flown_to_the_end(log)
    error = formation_error(log, tuple(itertools.permutations(log.vehicles, 2)))[steady(log)]
    assert error.mean() < 0.1


def event(kind: str, target: str, start: float, end: float, **values: object) -> str:
    items = ", ".join(f"{key}: {value}" for key, value in values.items())
    return f"{{kind: {kind}, target: {target}, start_s: {start}, end_s: {end}, {items}}}"


def events(*items: str) -> str:
    return f"events=[{', '.join(items)}]"


BLIND = {"sensor": "range_bearing"}
EVERYONE = ("leader", "follower_1", "follower_2")
SHORTENED = tuple(f"phases.{phase}.duration_s=4.0" for phase in (1, 2, 3, 4))


@pytest.mark.parametrize(
    ("disturbance", "worst_mean"),
    [
        (
            events(*(event("command_loss", name, 0.5, 99, probability=0.3) for name in EVERYONE)),
            0.09,
        ),
        (
            events(*(event("dropout", name, 0.5, 99, **BLIND, probability=0.2) for name in EVERYONE)),
            0.09,
        ),
        (events(event("dropout", "leader", 6.0, 7.0, sensor="localization", probability=1)), 0.085),
        (events(event("wind", "follower_1", 3.0, 9.0, force_n=[0.2, -0.3, 0.1])), 0.12),
    ],
    ids=["commands-lost", "blind-now-and-then", "leader-lost", "wind"],
)
def test_disturbed_flights_go_on(disturbance: str, worst_mean: float) -> None:
    log = fly(*SHORTENED, disturbance, seed=5)
    assert_flown_to_the_end(log)
    error = formation_error(log)[steady(log)]
    assert error.mean() < worst_mean


def test_the_same_seed_flies_the_same_flight_and_another_seed_another() -> None:
    first, second, other = (fly_in_process(paper_scenario(AGILE, seed=seed)) for seed in (7, 7, 8))
    np.testing.assert_array_equal(first.rotor_speeds, second.rotor_speeds)
    np.testing.assert_array_equal(first.p_NB_N, second.p_NB_N)
    assert np.abs(first.rotor_speeds - other.rotor_speeds).max() > 10.0


def test_a_vehicle_that_cannot_fly_ends_the_flight_with_a_fault() -> None:
    log = fly(events(event("thrust_scale", "follower_1", 1.0, 9.0, scale=0.05)), seed=1)
    assert len(log.faults) == 1
    assert log.faults[0].source == "follower_1"
    assert len(log.tick_of_step) < log.scenario.config.n_steps
