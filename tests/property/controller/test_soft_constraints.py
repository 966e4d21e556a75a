"""Soft constraints that contradict each other, at any price: every SQP step has a finite solution."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from relform_controller.ocp.problem import Ocp
from relform_controller.solver.solver import QpError, SqpStep
from relform_controller.solver.warm_start import hover_plan
from support.problems import SOLVERS, Problem, random_problem, solver_of
from support.scenarios import paper_scenario, team_of

N_CONSTRAINTS = 5
ITERATIONS_MAX = 68
"""Of the active-set method and the interior-point method, one after the other."""

exponents = st.floats(-2.0, 6.0)
price_pairs = st.tuples(exponents, st.one_of(st.none(), exponents))


def contradictory(prices: list[tuple[float, float | None]]) -> Ocp:
    """Vehicles far apart and within a short range, slow and upright in a mission that is neither."""
    tilt, speed, separation, view, keep_out = (
        f"price_per_unit: {10.0**linear}, square_price_per_unit2: {0.0 if square is None else 10.0**square}"
        for linear, square in prices
    )
    constraints = (
        "controller.constraints={"
        f"tilt: {{max_deg: 1, {tilt}}}, speed: {{max_m_s: 0.1, {speed}}}, "
        f"separation: {{min_m: 5.0, {separation}}}, "
        "field_of_view: {axis_azimuth_deg: 150, axis_elevation_deg: 20, half_angle_deg: 5, range_max_m: 0.5, "
        f"pairs: [[follower_1, leader], [leader, follower_1]], {view}}}, "
        f"keep_out: {{margin_m: 4.0, {keep_out}}}}}"
    )
    obstacle = "obstacles=[{kind: box, center_m: [0.1, -0.2, 1.0], size_m: [0.5, 0.5, 3.0], yaw_deg: 20.0}]"
    return Ocp.from_config(paper_scenario(*team_of(2), constraints, obstacle).config)


def sqp_steps(problem: Problem, ocp: Ocp, kind: type, count: int) -> list[SqpStep]:
    """From a hover, until one fails."""
    solver, geometry, steps = solver_of(ocp, kind), problem.poses.geometry(), []
    plan = hover_plan(problem.start, problem.config.vehicle.hover_thrust, ocp.n_stages)
    for _ in range(count):
        try:
            solver.prepare(plan, geometry)
            steps.append(solver.feedback(problem.start, geometry, problem.reference))
        except QpError:
            break
        plan = steps[-1].plan
    return steps


@settings(max_examples=20)
@given(
    seed=st.integers(0, 1000),
    disturbance=st.floats(0.01, 10.0),
    prices=st.lists(price_pairs, min_size=N_CONSTRAINTS, max_size=N_CONSTRAINTS),
)
def test_any_price_of_contradictory_constraints(
    seed: int, disturbance: float, prices: list[tuple[float, float | None]]
) -> None:
    problem, ocp = random_problem(seed, 2, disturbance=disturbance), contradictory(prices)
    kernel, reference = (sqp_steps(problem, ocp, kind, 3) for kind in SOLVERS)
    assert kernel, "the first QP has a solution"
    assert reference
    np.testing.assert_allclose(kernel[0].plan.thrusts, reference[0].plan.thrusts, atol=1e-4)
    for step in (*kernel, *reference):
        assert np.isfinite(step.plan.thrusts).all()
        assert np.isfinite(step.plan.states).all()
        assert np.isfinite([step.kkt, step.objective]).all()
        assert step.qp_iterations <= ITERATIONS_MAX
