"""One SQP step against SciPy's bounded least squares, with derivatives by differences of a simulation."""

import dataclasses

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from relform_controller.ocp import layout
from relform_controller.ocp.problem import Plan
from relform_controller.solver.kernel import KernelSolver
from relform_controller.solver.reference import ReferenceSolver
from support.problems import (
    SOLVERS,
    Poses,
    Problem,
    random_problem,
    random_thrusts_of_team,
    residual,
    simulate,
    simulated_plan,
    solver_of,
    weights,
)
from support.world import Array

STEP = 1e-5


def feasible_guess(problem: Problem, seed: int) -> Plan:
    thrusts = random_thrusts_of_team(seed, problem.ocp, problem.config.vehicle.hover_thrust)
    return simulated_plan(problem, thrusts)


def jacobian(problem: Problem, guess: Plan) -> Array:
    """d residual / d thrusts by central differences, shape (row, input)."""

    def at(thrusts: Array) -> Array:
        return residual(problem, guess.states[:, 0], thrusts.reshape(guess.thrusts.shape))

    flat = guess.thrusts.reshape(-1)
    return np.array([(at(flat + d) - at(flat - d)) / (2 * STEP) for d in np.eye(flat.size) * STEP]).T


def moved(problem: Problem, seed: int) -> Problem:
    """The same team at another place and with other velocities than predicted."""
    generator = np.random.default_rng(seed)
    poses = Poses(
        problem.poses.p_NI_N + generator.uniform(-0.05, 0.05, problem.poses.p_NI_N.shape),
        problem.poses.yaw_NI + generator.uniform(-0.1, 0.1, problem.poses.yaw_NI.shape),
    )
    states = problem.initial_states + generator.uniform(-0.1, 0.1, problem.initial_states.shape)
    states[:, layout.POSITION] = states[:, layout.YAW] = 0.0
    rotors = problem.rotor_thrusts + generator.uniform(-0.2, 0.2, problem.rotor_thrusts.shape)
    return dataclasses.replace(problem, poses=poses, initial_states=states, rotor_thrusts=rotors)


@pytest.mark.parametrize("kind", SOLVERS)
@pytest.mark.parametrize(
    ("seed", "n_vehicles", "disturbance", "time_constant_s", "bounds_are_active"),
    [(1, 2, 0.05, 0.0, False), (2, 3, 0.2, 0.0, True), (3, 4, 0.3, 0.0, True), (4, 3, 0.1, 0.05, True)],
)
def test_one_step_from_other_measurements_than_predicted(
    seed: int,
    n_vehicles: int,
    disturbance: float,
    time_constant_s: float,
    bounds_are_active: bool,
    kind: type[KernelSolver] | type[ReferenceSolver],
) -> None:
    """The gradient at the guess is that of the measured geometry, the Hessian that of the prepared one; the
    measured states and thrusts of the rotors enter to first order.
    """
    overrides = ("controller.horizon_steps=6", f"vehicle.rotor_time_constant_s={time_constant_s}")
    predicted = random_problem(seed, n_vehicles, *overrides, disturbance=disturbance)
    measured = moved(predicted, seed)
    ocp, guess = predicted.ocp, feasible_guess(predicted, seed)
    rti = solver_of(ocp, kind)
    rti.prepare(guess, predicted.poses.geometry())
    found = rti.feedback(measured.start, measured.poses.geometry(), measured.reference)

    scale = np.sqrt(weights(predicted))
    at_guess = dataclasses.replace(
        measured,
        initial_states=predicted.initial_states,
        rotor_thrusts=predicted.rotor_thrusts,
        applied_thrusts=guess.thrusts[:, 0],
    )
    J, J_measured = (scale[:, None] * jacobian(problem, guess) for problem in (predicted, at_guess))
    change = measured.initial_states - predicted.initial_states
    rotor_change = measured.rotor_thrusts - predicted.rotor_thrusts
    applied_change = measured.applied_thrusts - guess.thrusts[:, 0]

    def along(share: float, geometry_of: Problem) -> Array:
        """From the guess towards the measured start."""
        problem = dataclasses.replace(
            geometry_of, applied_thrusts=guess.thrusts[:, 0] + share * applied_change
        )
        states = predicted.initial_states + share * change
        rotors = predicted.rotor_thrusts + share * rotor_change
        return scale * residual(problem, states, guess.thrusts, rotors)

    def by_start(geometry_of: Problem) -> Array:
        return (along(STEP, geometry_of) - along(-STEP, geometry_of)) / (2 * STEP)

    r0 = along(0.0, measured)
    gradient_half = J_measured.T @ r0 + J.T @ by_start(predicted)
    # Residuals whose gradient with J is the same.
    r = by_start(predicted) + J @ np.linalg.solve(J.T @ J, J_measured.T @ r0)
    flat = guess.thrusts.reshape(-1)
    bounds = (ocp.thrust_min - flat, ocp.thrust_max - flat)
    expected = lsq_linear(J, -r, bounds, method="bvls", tol=1e-14)
    assert expected.success
    step = found.plan.thrusts.reshape(-1) - flat
    np.testing.assert_allclose(step, expected.x, atol=1e-5)
    constant = r0 @ r0 + 2.0 * r0 @ by_start(measured) + by_start(predicted) @ by_start(predicted)
    objective = constant + 2.0 * gradient_half @ expected.x + np.sum((J @ expected.x) ** 2)
    assert found.objective == pytest.approx(objective, rel=1e-6)
    assert found.active_bounds == np.count_nonzero(expected.active_mask)
    assert (found.active_bounds > 0) == bounds_are_active

    # |gradient . step| + sum |multiplier * bound|: the multiplier of an active bound is the slope left there.
    gradient, slope = 2.0 * J.T @ r, 2.0 * J.T @ (r + J @ expected.x)
    kkt = abs(gradient @ expected.x) + np.abs(slope * expected.x)[expected.active_mask != 0].sum()
    assert found.kkt == pytest.approx(kkt, rel=1e-4)


@pytest.mark.parametrize("seed", [4, 5])
def test_a_measured_state_other_than_the_guessed_one_enters_to_first_order(seed: int) -> None:
    problem = random_problem(seed, 3, "controller.horizon_steps=6", disturbance=0.1)
    guess = feasible_guess(problem, seed)
    change = np.random.default_rng(seed).uniform(-0.1, 0.1, problem.initial_states.shape)
    change[:, layout.POSITION] = change[:, layout.YAW] = 0.0
    rti = solver_of(problem.ocp)
    rti.prepare(guess, problem.poses.geometry())
    start = dataclasses.replace(problem.start, states=problem.initial_states + change)
    found = rti.feedback(start, problem.poses.geometry(), problem.reference)

    scale = np.sqrt(weights(problem))
    ahead, behind = (
        residual(problem, problem.initial_states + sign * STEP * change, guess.thrusts) for sign in (1, -1)
    )
    r = scale * (residual(problem, problem.initial_states, guess.thrusts) + (ahead - behind) / (2 * STEP))
    flat = guess.thrusts.reshape(-1)
    bounds = (problem.ocp.thrust_min - flat, problem.ocp.thrust_max - flat)
    expected = lsq_linear(scale[:, None] * jacobian(problem, guess), -r, bounds, method="bvls", tol=1e-14)
    np.testing.assert_allclose(found.plan.thrusts.reshape(-1) - flat, expected.x, atol=1e-5)
    np.testing.assert_array_equal(found.plan.states[:, 0], problem.initial_states + change)
    # The states follow their initial values and the inputs, to first order too.
    du = found.plan.thrusts - guess.thrusts
    ahead, behind = (
        simulate(problem.ocp, problem.initial_states + sign * STEP * change, guess.thrusts + sign * STEP * du)
        for sign in (1, -1)
    )
    np.testing.assert_allclose(found.plan.states, guess.states + (ahead - behind) / (2 * STEP), atol=1e-6)
