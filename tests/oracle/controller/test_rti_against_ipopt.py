"""The real-time iteration, iterated on one frozen state, against the nonlinear program solved by IPOPT.

This module builds the program again: multiple shooting over all states and inputs, a body whose Euler rates
come from inverting those of its three hinges, planar positions as complex numbers.
"""

import dataclasses
import itertools
import math
from typing import Any

import casadi as ca
import numpy as np
import pytest

from relform_controller.ocp import layout
from relform_controller.ocp.problem import Plan, TeamGeometry
from relform_controller.solver.solver import SqpStep
from relform_controller.solver.warm_start import hover_plan
from support.problems import Problem, random_problem, solver_of
from support.world import Array


def vertical_thrust_direction(rpy: ca.SX) -> ca.SX:
    """z of the body, in {mi}."""
    (s1, s2, s3), (c1, c2, c3) = ca.vertsplit(ca.sin(rpy)), ca.vertsplit(ca.cos(rpy))
    return ca.vertcat(c3 * s2 * c1 + s3 * s1, s3 * s2 * c1 - c3 * s1, c2 * c1)


def torque(problem: Problem, thrusts: ca.SX) -> ca.SX:
    vehicle = problem.config.vehicle
    total = ca.SX.zeros(3)
    for rotor, (x, y) in enumerate([(1, 0), (0, 1), (-1, 0), (0, -1)]):
        arm = vehicle.arm_length * ca.vertcat(x, y, 0)
        total += ca.cross(arm, ca.vertcat(0, 0, thrusts[rotor]))
        total[2] += (-1) ** rotor * thrusts[rotor] * vehicle.torque_coefficient / vehicle.thrust_coefficient
    return total


def rate(problem: Problem, x: ca.SX, u: ca.SX) -> ca.SX:
    vehicle = problem.config.vehicle
    rpy, w = x[6:9], x[9:12]
    roll, pitch, _ = ca.vertsplit(rpy)
    w_by_rpy_rate = ca.vertcat(
        ca.horzcat(1, 0, -ca.sin(pitch)),
        ca.horzcat(0, ca.cos(roll), ca.sin(roll) * ca.cos(pitch)),
        ca.horzcat(0, -ca.sin(roll), ca.cos(roll) * ca.cos(pitch)),
    )
    inertia = ca.DM(vehicle.inertia)
    acceleration = vertical_thrust_direction(rpy) * ca.sum1(u) / vehicle.mass - ca.vertcat(0, 0, 9.81)
    acceleration -= vehicle.drag_coefficient[0] / vehicle.mass * x[3:6]  # along all axes alike
    w_rate = (torque(problem, u) - ca.cross(w, inertia * w)) / inertia
    return ca.vertcat(x[3:6], acceleration, ca.solve(w_by_rpy_rate, w), w_rate)


def following(problem: Problem, x: ca.SX, u: ca.SX) -> ca.SX:
    h = problem.config.controller.period
    k1 = rate(problem, x, u)
    k2 = rate(problem, x + h / 2 * k1, u)
    k3 = rate(problem, x + h / 2 * k2, u)
    k4 = rate(problem, x + h * k3, u)
    return x + h / 6 * (k1 + 2 * (k2 + k3) + k4)


def lagged(problem: Problem, T: ca.SX, u: ca.SX) -> tuple[ca.SX, ca.SX]:
    """Mean thrust over one stage and thrust at its end, of rotors that start with T."""
    tau, h = problem.config.vehicle.rotor_time_constant, problem.config.controller.period
    if tau == 0.0:
        return u, u
    left = math.exp(-h / tau)
    return u + (T - u) * tau / h * (1.0 - left), u + (T - u) * left


def turn(angle: ca.SX, x: ca.SX, y: ca.SX) -> tuple[ca.SX, ca.SX]:
    """exp(i angle) (x + i y)."""
    return ca.cos(angle) * x - ca.sin(angle) * y, ca.cos(angle) * y + ca.sin(angle) * x


def relative_position(observer: ca.SX, target: ca.SX, p: Array, yaw: float) -> ca.SX:
    x, y = turn(yaw, target[0], target[1])
    x, y = turn(-observer[8], x + p[0] - observer[0], y + p[1] - observer[1])
    return ca.vertcat(x, y, target[2] + p[2] - observer[2])


def cost(
    problem: Problem,
    geometry: TeamGeometry,
    X: list[list[ca.SX]],
    U: list[list[ca.SX]],
    F: list[list[ca.SX]],
) -> ca.SX:
    """Of states, commands and mean thrusts."""
    w, reference, N = problem.config.controller.weights, problem.reference, problem.ocp.n_stages
    total = ca.SX(0)
    for k in range(1, N + 1):
        at_k = ca.SX(0)
        for pair, (i, j) in enumerate(problem.ocp.pairs):
            p = relative_position(X[i][k], X[j][k], geometry.p_I1I2_I1[pair], float(geometry.yaw_I1I2[pair]))
            at_k += 2.0 / (len(X) - 1) * w.formation * ca.sumsqr(p - reference.p_B1B2_C1[pair, k])
        leader = X[0][k]
        x, y = turn(geometry.yaw_NI, leader[0], leader[1])
        p_NB_N = ca.vertcat(x, y, leader[2]) + geometry.p_NI_N
        at_k += len(X) / 3.0 * w.leader_position * ca.sumsqr(p_NB_N - reference.p_NB_N[k])
        at_k += len(X) / 3.0 * w.leader_yaw * (leader[8] + geometry.yaw_NI - reference.yaw_NB[k]) ** 2
        total += at_k * (w.terminal_scale if k == N else 1.0)
    for vehicle, (states, thrusts, means) in enumerate(zip(X, U, F, strict=True)):
        before: Any = problem.applied_thrusts[vehicle]
        for x_k, u_k, f_k in zip(states, thrusts, means, strict=False):
            total += w.acceleration * ca.sumsqr(rate(problem, x_k, f_k)[3:6])
            total += w.torque * ca.sumsqr(torque(problem, u_k)) + w.thrust_rate * ca.sumsqr(u_k - before)
            before = u_k
    return total


def solve_by_ipopt(problem: Problem, geometry: TeamGeometry) -> tuple[Plan, float]:
    n, N = problem.ocp.n_vehicles, problem.ocp.n_stages
    X = [[ca.SX.sym(f"x{i}_{k}", 12) for k in range(N + 1)] for i in range(n)]
    U = [[ca.SX.sym(f"u{i}_{k}", 4) for k in range(N)] for i in range(n)]
    x, u = ca.SX.sym("x", 12), ca.SX.sym("u", 4)
    step = ca.Function("step", [x, u], [following(problem, x, u)])
    gaps = [X[i][0] - problem.initial_states[i] for i in range(n)]
    F: list[list[ca.SX]] = []
    for i in range(n):
        T, means = ca.SX(problem.rotor_thrusts[i]), []
        for u_k in U[i]:
            mean, T = lagged(problem, T, u_k)
            means.append(mean)
        F.append(means)
    gaps += [X[i][k + 1] - step(X[i][k], F[i][k]) for i in range(n) for k in range(N)]
    inputs, states = (ca.vertcat(*itertools.chain.from_iterable(part)) for part in (U, X))
    nlp = {"x": ca.vertcat(inputs, states), "f": cost(problem, geometry, X, U, F), "g": ca.vertcat(*gaps)}
    options = {
        "print_time": False,
        "ipopt": {"print_level": 0, "sb": "yes", "tol": 1e-11, "bound_relax_factor": 0.0},
    }
    solver = ca.nlpsol("solver", "ipopt", nlp, options)
    free = np.full(states.numel(), np.inf)
    vehicle = problem.config.vehicle
    lowest, highest = (
        vehicle.thrust_coefficient * w**2 for w in (vehicle.rotor_speed_min, vehicle.rotor_speed_max)
    )
    solution = solver(
        x0=np.concatenate(
            [
                np.full(inputs.numel(), vehicle.hover_thrust),
                np.repeat(problem.initial_states[:, None], N + 1, axis=1).reshape(-1),
            ]
        ),
        lbx=np.concatenate([np.full(inputs.numel(), lowest), -free]),
        ubx=np.concatenate([np.full(inputs.numel(), highest), free]),
        lbg=0,
        ubg=0,
    )
    assert solver.stats()["success"]
    values = np.array(solution["x"]).reshape(-1)
    thrusts = values[: inputs.numel()].reshape(n, N, 4)
    states = values[inputs.numel() :].reshape(n, N + 1, 12)
    return Plan(states, thrusts, problem.rotors), float(solution["f"])


def iterate(problem: Problem, geometry: TeamGeometry, kkt: float) -> SqpStep:
    """Full Gauss-Newton steps from hover."""
    rti = solver_of(problem.ocp)
    plan = hover_plan(problem.start, problem.config.vehicle.hover_thrust, problem.ocp.n_stages)
    for _ in range(100):
        rti.prepare(plan, geometry)
        step = rti.feedback(problem.start, geometry, problem.reference)
        plan = step.plan
        if step.kkt < kkt:
            return step
    pytest.fail(f"no convergence: KKT {step.kkt}")


PAPER_WEIGHTS = (
    "controller.weights.acceleration_per_m2_s4=0.01",
    "controller.weights.torque_per_n2_m2=100",
    "controller.weights.thrust_rate_per_n2=0",
    "controller.weights.terminal_scale=1",
)


def noisy(problem: Problem, geometry: TeamGeometry, seed: int) -> tuple[Problem, TeamGeometry]:
    """As raw feedback sees it: bad velocities and rates, and relative poses that do not fit each other."""
    generator = np.random.default_rng(seed)
    states = problem.initial_states.copy()
    states[:, layout.VELOCITY] += 0.25 * generator.standard_normal((len(states), 3))
    states[:, layout.RATE] += 0.05 * generator.standard_normal((len(states), 3))
    p_I1I2_I1 = geometry.p_I1I2_I1 + 0.025 * generator.standard_normal(geometry.p_I1I2_I1.shape)
    yaw_I1I2 = geometry.yaw_I1I2 + 0.03 * generator.standard_normal(geometry.yaw_I1I2.shape)
    return (
        dataclasses.replace(problem, initial_states=states),
        dataclasses.replace(geometry, p_I1I2_I1=p_I1I2_I1, yaw_I1I2=yaw_I1I2),
    )


@pytest.mark.parametrize(
    ("seed", "n_vehicles", "overrides", "disturbance", "bounds_are_active"),
    [
        (1, 2, (), 0.1, False),
        (2, 3, (), 0.2, True),
        (3, 3, PAPER_WEIGHTS, 0.2, True),
        (4, 4, ("controller.horizon_steps=10",), 0.2, True),
        (5, 3, ("vehicle.rotor_time_constant_s=0.05",), 0.2, True),
        (6, 2, ("vehicle.drag_coefficient_n_s_m=[0.25, 0.25, 0.25]",), 0.1, False),
    ],
)
def test_iterated_to_the_solution_of_the_nonlinear_program(
    seed: int, n_vehicles: int, overrides: tuple[str, ...], disturbance: float, bounds_are_active: bool
) -> None:
    problem = random_problem(seed, n_vehicles, *overrides, disturbance=disturbance)
    problem, geometry = noisy(problem, problem.poses.geometry(), seed)
    found = iterate(problem, geometry, kkt=1e-10)
    expected, objective = solve_by_ipopt(problem, geometry)
    np.testing.assert_allclose(found.plan.thrusts, expected.thrusts, rtol=1e-4)
    np.testing.assert_allclose(found.plan.states, expected.states, atol=1e-4)
    assert found.objective == pytest.approx(objective, rel=1e-8)
    assert (found.active_bounds > 0) == bounds_are_active
