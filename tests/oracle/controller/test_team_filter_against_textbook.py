"""The team filter against the textbook: Jacobians by differences, and the Kalman filter in Joseph's form."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from relform_controller.estimation import team_model
from relform_controller.estimation.team_belief import Belief, Observation
from relform_controller.estimation.team_filter import (
    ReferenceTeamFilter,
    TeamFilter,
    residuals,
    squared_distances,
)
from relform_controller.estimation.team_kernel import CompiledTeamFilter
from relform_controller.estimation.team_model import N_FILTER_STATE, N_OWN_ROWS
from relform_controller.ocp import layout
from relform_controller.ocp.model import RigidBody
from support.scenarios import paper_scenario

N = 3
DRAG = np.array([0.3, 0.2, 0.1])
BODY = RigidBody.from_config(paper_scenario(f"vehicle.drag_coefficient_n_s_m={DRAG.tolist()}").config.vehicle)
PAIRS = layout.ordered_pairs(N)


REFERENCE = ReferenceTeamFilter(BODY, N)


@pytest.fixture(scope="module", params=[ReferenceTeamFilter, CompiledTeamFilter])
def team_filter(request: pytest.FixtureRequest) -> TeamFilter:
    made: TeamFilter = request.param(BODY, N)
    return made


def random_states(generator: np.random.Generator) -> np.ndarray:
    states = generator.uniform(-0.4, 0.4, (N, N_FILTER_STATE))
    states[:, layout.POSITION] += [[5.0, -3.0, 2.0], [3.6, -3.7, 1.6], [3.9, -2.2, 2.5]]
    states[:, layout.YAW] = generator.uniform(-3.0, 3.0, N)
    states[:, team_model.THRUST_SCALE] = generator.uniform(0.9, 1.1, N)
    states[:, team_model.INERTIA_SCALE] = generator.uniform(0.9, 1.1, (N, 3))
    return states


def random_belief(generator: np.random.Generator) -> Belief:
    root = generator.standard_normal((N * N_FILTER_STATE, N * N_FILTER_STATE))
    return Belief(
        random_states(generator), np.linalg.cholesky(0.01 * root @ root.T + 0.01 * np.eye(len(root)))
    )


def random_thrusts(generator: np.random.Generator) -> np.ndarray:
    return generator.uniform(1.2, 2.4, (N, layout.N_INPUT))


def random_observation(generator: np.random.Generator, states: np.ndarray) -> Observation:
    roots = generator.standard_normal((len(PAIRS), 3, 3))
    roots[2] = 0.0  # not seen
    own_weights = generator.uniform(0.5, 3.0, (N, N_OWN_ROWS))
    own_weights[1:, team_model.POSITION_ROWS] = 0.0
    own = np.array(
        [
            expected_own(state, thrusts)
            for state, thrusts in zip(states, random_thrusts(generator), strict=True)
        ]
    )
    sightings = np.array([expected_sighting(states[i], states[j]) for i, j in PAIRS])
    return Observation(
        own + 0.1 * generator.standard_normal(own.shape),
        own_weights,
        sightings + 0.05 * generator.standard_normal(sightings.shape),
        roots,
    )


def attitude(state: np.ndarray) -> Rotation:
    roll, pitch, yaw = state[layout.RPY]
    return Rotation.from_euler("ZYX", [yaw, pitch, roll])


def expected_own(state: np.ndarray, thrusts: np.ndarray) -> np.ndarray:
    """What a vehicle measures of itself, by SciPy's rotations."""
    R_BN = attitude(state).inv()
    thrust_B = np.array([0.0, 0.0, state[team_model.THRUST_SCALE] * thrusts.sum() / BODY.mass])
    v_NB_B = R_BN.apply(state[layout.VELOCITY])
    return np.concatenate(
        [
            state[[layout.ROLL, layout.PITCH]],
            state[layout.RATE],
            thrust_B - DRAG * v_NB_B / BODY.mass + R_BN.apply(state[team_model.DISTURBANCE]),
            v_NB_B,
            state[layout.POSITION][2:],
            state[layout.POSITION],
            v_NB_B,
            [state[layout.YAW]],
            state[team_model.DISTURBANCE],
            [state[team_model.THRUST_SCALE]],
        ]
    )


def expected_sighting(observer: np.ndarray, target: np.ndarray) -> np.ndarray:
    p_B1B2_B1 = attitude(observer).inv().apply(target[layout.POSITION] - observer[layout.POSITION])
    x, y, z = p_B1B2_B1
    return np.array([np.linalg.norm(p_B1B2_B1), np.arctan2(y, x), np.arcsin(z / np.linalg.norm(p_B1B2_B1))])


def whitened(states: np.ndarray, thrusts: np.ndarray, observation: Observation) -> np.ndarray:
    """Whitened expected measurements, one long vector."""
    own = observation.own_weights * [expected_own(*each) for each in zip(states, thrusts, strict=True)]
    seen = np.array([expected_sighting(states[i], states[j]) for i, j in PAIRS])
    sightings = observation.sighting_weights @ seen[:, :, None]
    return np.concatenate([own.reshape(-1), sightings.reshape(-1)])


def differences(function: object, states: np.ndarray, step: float = 1e-6) -> np.ndarray:
    """Jacobian of a function of all states by central differences."""
    columns = []
    for k in range(states.size):
        change = np.zeros(states.size)
        change[k] = step
        above, below = (function(states + sign * change.reshape(states.shape)) for sign in (1.0, -1.0))
        columns.append((above - below) / (2.0 * step))
    return np.array(columns).T


def mahalanobis(innovation: np.ndarray, rows: np.ndarray) -> float:
    """Squared distance of a whitened innovation with these rows of W."""
    return float(innovation @ np.linalg.inv(np.eye(len(rows)) + rows @ rows.T) @ innovation)


@pytest.mark.parametrize("seed", range(3))
def test_innovation_and_its_rows(team_filter: TeamFilter, seed: int) -> None:
    generator = np.random.default_rng(seed)
    belief, thrusts = random_belief(generator), random_thrusts(generator)
    observation = random_observation(generator, belief.states)
    found = team_filter.innovation(belief, thrusts, observation)
    measured = np.concatenate(
        [
            (observation.own_weights * observation.own).reshape(-1),
            (observation.sighting_weights @ observation.sightings[:, :, None]).reshape(-1),
        ]
    )
    r = residuals(found)
    np.testing.assert_allclose(r, measured - whitened(belief.states, thrusts, observation), atol=1e-9)
    H = differences(lambda states: whitened(states, thrusts, observation), belief.states)
    W = REFERENCE.rows(belief, found)
    np.testing.assert_allclose(W, H @ belief.factor, atol=1e-6)
    rows = dict(enumerate(W[: N * N_OWN_ROWS].reshape(N, N_OWN_ROWS, -1)))
    for vehicle, own in enumerate(found.own):
        tilt_and_rates = range(N_OWN_ROWS)[team_model.TILT_ROWS.start : team_model.RATE_ROWS.stop]
        distance = mahalanobis(own[tilt_and_rates], rows[vehicle][tilt_and_rates])
        assert found.torque_distances[vehicle] == pytest.approx(distance)
        force = team_model.SPECIFIC_FORCE_ROWS
        distance = mahalanobis(own[force], rows[vehicle][force])
        assert (found.forces[vehicle] ** 2).sum() == pytest.approx(distance)
    leader = [*range(N_OWN_ROWS)[team_model.POSITION_ROWS], team_model.YAW_ROW]
    assert found.leader_distance[0] == pytest.approx(mahalanobis(found.own[0, leader], rows[0][leader]))
    for sighting, sighting_rows, distance in zip(
        found.sightings, W[N * N_OWN_ROWS :].reshape(-1, 3, W.shape[1]), found.sighting_distances, strict=True
    ):
        assert distance == pytest.approx(mahalanobis(sighting, sighting_rows))


@pytest.mark.parametrize("seed", range(3))
def test_correction_is_that_of_the_kalman_filter(team_filter: TeamFilter, seed: int) -> None:
    generator = np.random.default_rng(10 + seed)
    belief, thrusts = random_belief(generator), random_thrusts(generator)
    observation = random_observation(generator, belief.states)
    innovation = team_filter.innovation(belief, thrusts, observation)
    corrected = team_filter.correct(belief, innovation)

    H = differences(lambda states: whitened(states, thrusts, observation), belief.states)
    r = residuals(innovation)
    P = belief.covariance
    K = P @ H.T @ np.linalg.inv(H @ P @ H.T + np.eye(len(r)))
    I_KH = np.eye(len(P)) - K @ H
    np.testing.assert_allclose(corrected.covariance, I_KH @ P @ I_KH.T + K @ K.T, atol=1e-6)
    change = (corrected.states - belief.states).reshape(-1)
    expected = K @ r
    yaw = np.arange(layout.YAW, len(P), N_FILTER_STATE)
    change[yaw] = expected[yaw] + np.angle(np.exp(1j * (change[yaw] - expected[yaw])))
    np.testing.assert_allclose(change, expected, atol=1e-6)


def test_prediction_moves_mean_and_covariance(team_filter: TeamFilter) -> None:
    generator = np.random.default_rng(5)
    belief, thrusts = random_belief(generator), random_thrusts(generator)
    noise = generator.uniform(0.0, 0.01, (N, N_FILTER_STATE))
    found = team_filter.predict(belief, thrusts, 0.03, noise)

    def moved(states: np.ndarray) -> np.ndarray:
        return team_filter.predict(Belief(states, belief.factor), thrusts, 0.03, noise).states.reshape(-1)

    F = differences(moved, belief.states)
    expected = F @ belief.covariance @ F.T + np.diag(noise.reshape(-1))
    np.testing.assert_allclose(found.covariance, expected, atol=1e-6)


def test_scales_are_those_of_another_body() -> None:
    """A vehicle with scaled inertia and thrust moves as a nominal one with that inertia and those thrusts."""
    generator = np.random.default_rng(9)
    state, thrusts = random_states(generator)[0], random_thrusts(generator)[0]
    nominal = state.copy()
    nominal[team_model.INERTIA_SCALE], nominal[team_model.THRUST_SCALE] = 1.0, 1.0
    scaled = tuple(np.array(BODY.inertia) * state[team_model.INERTIA_SCALE])
    scaled_thrusts = state[team_model.THRUST_SCALE] * thrusts
    found = team_model.transition(BODY)(state, thrusts, 0.05)[0]
    expected = team_model.transition(replace(BODY, inertia=scaled))(nominal, scaled_thrusts, 0.05)[0]
    np.testing.assert_allclose(found[: layout.N_STATE], expected[: layout.N_STATE], atol=1e-12)
    np.testing.assert_array_equal(np.array(found)[layout.N_STATE :, 0], state[layout.N_STATE :])


def test_squared_distances_follow_the_chi_square_distribution(team_filter: TeamFilter) -> None:
    """Innovations that the belief itself gives have the distribution of chi-square with three degrees."""
    generator = np.random.default_rng(6)
    belief, thrusts = random_belief(generator), random_thrusts(generator)
    observation = random_observation(generator, belief.states)
    innovation = team_filter.innovation(belief, thrusts, observation)
    rows = REFERENCE.rows(belief, innovation)[None, N * N_OWN_ROWS :][:, :3]
    draws = 20000
    errors = (
        generator.standard_normal((draws, 3)) + generator.standard_normal((draws, rows.shape[2])) @ rows[0].T
    )
    distances = squared_distances(errors, np.repeat(rows, draws, axis=0))
    assert distances.mean() == pytest.approx(3.0, rel=0.03)
    assert (distances > chi2.ppf(0.99, 3)).mean() == pytest.approx(0.01, abs=0.003)
