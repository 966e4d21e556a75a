"""The posterior Cramer-Rao bound against SciPy's Riccati equation, its published form, and a flight."""

import numpy as np
import pytest
from scipy.linalg import solve_discrete_are

from relform_analysis.judges.command import main
from relform_analysis.judges.cramer_rao import ASSUMPTIONS, next_information, pair_bounds
from relform_analysis.judges.flown import fly
from relform_analysis.judges.linearised import pair_errors, pair_position_jacobian, pair_positions
from relform_controller.ocp import layout
from relform_controller.ocp.model import RigidBody
from support.scenarios import paper_scenario
from support.sweeps import short_phases


def random_model(seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """F, Q and H of a linear system with five states, of which two are measured."""
    generator = np.random.default_rng(seed)
    F = np.eye(5) + 0.3 * generator.normal(size=(5, 5))
    root = generator.normal(size=(5, 5))
    return F, root @ root.T, generator.normal(size=(2, 5))


@pytest.mark.parametrize("seed", range(4))
def test_linear_system_reaches_the_riccati_solution(seed: int) -> None:
    F, Q, H = random_model(seed)
    information = np.eye(5)
    for _ in range(300):
        information = next_information(information, F, Q, H.T @ H)
    predicted = solve_discrete_are(F.T, H.T, Q, np.eye(2))  # of the state before its measurements
    np.testing.assert_allclose(information, np.linalg.inv(predicted) + H.T @ H, rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize("seed", range(4))
def test_recursion_is_the_published_one(seed: int) -> None:
    """Equation (21) of Tichavsky, Muravchik and Nehorai, literally."""
    F, Q, H = random_model(seed)
    J = np.diag([1.0, 2.0, 0.5, 3.0, 1.5])
    D11, D12 = F.T @ np.linalg.solve(Q, F), -np.linalg.solve(Q, F).T
    D22 = np.linalg.inv(Q) + H.T @ H
    published = D22 - D12.T @ np.linalg.solve(J + D11, D12)
    np.testing.assert_allclose(next_information(J, F, Q, H.T @ H), published, rtol=1e-9, atol=1e-9)


def test_known_motion_without_noise_adds_information() -> None:
    """A constant that is measured k times: its information is k times that of one measurement."""
    information = np.array([[4.0]])
    for _ in range(9):
        information = next_information(information, np.eye(1), np.zeros((1, 1)), np.array([[4.0]]))
    assert information[0, 0] == pytest.approx(40.0)


def test_jacobian_of_a_relative_position_against_differences() -> None:
    states = np.random.default_rng(2).normal(size=(3, 16))
    for pair, (i, j) in enumerate(layout.ordered_pairs(3)):
        numerical = np.empty((3, states.size))
        for k in range(states.size):
            change = np.zeros(states.size)
            change[k] = 1e-6
            above, below = (
                pair_positions(states + sign * change.reshape(states.shape))[pair] for sign in (1.0, -1.0)
            )
            numerical[:, k] = (above - below) / 2e-6
        np.testing.assert_allclose(pair_position_jacobian(states, i, j), numerical, atol=1e-8)


def test_estimator_is_near_what_its_sensors_allow() -> None:
    scenario = paper_scenario("controller=team", short_phases(6.0), seed=11)
    body = RigidBody.from_config(scenario.config.vehicle)
    bounds, errors = [], []
    for seed in (11, 12):
        steps = fly(scenario.with_seed(seed))
        bounds.append([pair_bounds(steps, body, 0.05, each)[20:] for each in ASSUMPTIONS])
        errors.append(
            [np.linalg.norm(pair_errors(step.estimate, step.states), axis=-1) for step in steps][20:]
        )
    rms = float(np.sqrt(np.mean(np.square(errors))))
    exact, unknown_force, as_the_filter = np.sqrt(np.mean(np.square(bounds), axis=(0, 2, 3)))
    assert exact < min(unknown_force, as_the_filter)
    assert exact < rms
    assert 0.75 < rms / as_the_filter < 1.25


def test_command_prints_bounds_beside_the_estimator(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--flights", "1", "--set", short_phases(2.0)]) == 0
    numbers = [float(line.split()[-1]) for line in capsys.readouterr().out.splitlines()[-4:]]
    assert len(numbers) == 1 + len(ASSUMPTIONS)
    assert all(1.0 < number < 30.0 for number in numbers)


def test_delays_are_not_judged(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--set", "links={up: {delay_s: 0.05}}"]) == 2
    assert "only flights with perfect links and rotors without lag are judged" in capsys.readouterr().err
