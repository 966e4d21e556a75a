"""The team estimator beside a batch smoother: all states of a window at once, by sparse least squares.

The smoother shares the filter's model and tuning, but neither its recursion nor its square roots: it
minimises the squares of prior, motion and measurements over all states together (Gauss-Newton, SciPy's sparse
solver).
At the last instant of a window both have used the same measurements.
"""

from collections.abc import Sequence

import numpy as np
import pytest
from scipy import sparse
from scipy.sparse.linalg import splu

from relform_analysis.judges.flown import FlownStep, fly
from relform_analysis.judges.linearised import LinearisedTeam, pair_positions
from relform_controller.estimation import team_model, team_noise
from relform_controller.ocp import layout
from relform_controller.ocp.frames import wrap_angles
from relform_controller.ocp.model import RigidBody
from relform_core.arrays import Array
from support.scenarios import paper_scenario
from support.sweeps import short_phases

SCENARIO = paper_scenario("controller=team", short_phases(2.4), seed=41)
BODY = RigidBody.from_config(SCENARIO.config.vehicle)
PERIOD = SCENARIO.config.controller.period
N = len(SCENARIO.config.team.vehicles)
HOVER = np.full((N, layout.N_INPUT), SCENARIO.config.vehicle.hover_thrust)


@pytest.fixture(scope="module")
def flight() -> list[FlownStep]:
    return fly(SCENARIO)


def residuals_and_rows(
    states: Array, steps: Sequence[FlownStep]
) -> tuple[list[Array], list[dict[int, Array]]]:
    """Whitened residuals of prior, motion and measurements, and minus their Jacobians by instant."""
    team, prior = LinearisedTeam(BODY, N, PERIOD), np.tile(team_noise.START, N)
    at_rest = np.zeros_like(states[0])
    at_rest[:, layout.POSITION] = steps[0].states[:, layout.POSITION]  # known to ten metres only
    at_rest[:, [team_model.THRUST_SCALE, *range(19)[team_model.INERTIA_SCALE]]] = 1.0
    residuals, rows = [(at_rest - states[0]).reshape(-1) / prior], [{0: np.diag(1.0 / prior)}]
    thrusts = HOVER
    for k, step in enumerate(steps):
        residual, W = team.measurement(states[k], thrusts, step.observation)
        residuals.append(residual)
        rows.append({k: W})
        thrusts = step.thrusts
        if k + 1 < len(steps):
            following, F = team.motion(states[k], thrusts)
            change = following - states[k + 1]
            change[:, layout.YAW] = wrap_angles(change[:, layout.YAW])
            noise = team_noise.ProcessNoise().variances(thrusts, PERIOD, BODY).reshape(-1)
            residuals.append(change.reshape(-1) * noise**-0.5)
            rows.append({k: -F * noise[:, None] ** -0.5, k + 1: np.diag(noise**-0.5)})
    return residuals, rows


def smoothed(steps: Sequence[FlownStep]) -> Array:
    """The most likely states, shape (steps, vehicle, 19)."""
    states = np.array([step.states for step in steps])  # where the search starts
    for _ in range(10):
        residuals, rows = residuals_and_rows(states, steps)
        blocks = [
            [row.get(k, sparse.csr_array((len(residual), states[0].size))) for k in range(len(steps))]
            for residual, row in zip(residuals, rows, strict=True)
        ]
        J = sparse.block_array(blocks, format="csc")
        scale = sparse.diags_array(1.0 / np.sqrt((J**2).sum(axis=0)))
        scaled = (J @ scale).tocsc()
        change = scale @ splu((scaled.T @ scaled).tocsc()).solve(scaled.T @ np.concatenate(residuals))
        states = states + change.reshape(states.shape)
        if np.abs(change).max() < 1e-6:
            return states
    raise AssertionError("the smoother does not converge")


def test_filter_and_smoother_agree(flight: list[FlownStep]) -> None:
    filtered_errors, smoothed_errors = [], []
    for end in (20, 45):
        last, states = flight[end], smoothed(flight[: end + 1])[-1]
        deviations = [np.sqrt(np.diag(pair.covariance)) for pair in last.estimate.pairs]
        estimated = np.array([pair.p_B1B2_C1__est for pair in last.estimate.pairs])
        yaws = np.array([pair.yaw_I1I2 for pair in last.estimate.pairs])
        smooth_yaws = [states[j, layout.YAW] - states[i, layout.YAW] for i, j in layout.ordered_pairs(N)]
        # Far less than one standard deviation: what is left are other points of linearisation.
        differences = np.column_stack(
            [estimated - pair_positions(states), wrap_angles(yaws - np.array(smooth_yaws))]
        )
        assert np.abs(differences / deviations).max() < 0.3
        leader = last.estimate.leader
        difference = leader.p_NB_N - states[0, layout.POSITION]
        assert np.abs(difference / np.sqrt(np.diag(leader.covariance))[:3]).max() < 0.3
        true = pair_positions(last.states)
        filtered_errors.append(estimated - true)
        smoothed_errors.append(pair_positions(states) - true)
    rms = [float(np.sqrt(np.mean(np.square(errors)))) for errors in (filtered_errors, smoothed_errors)]
    assert rms[0] < 1.1 * rms[1]
    assert rms[0] < 0.015
