"""The solver in C against the NumPy reference, soft constraints included."""

from pathlib import Path

import numpy as np
import pytest

from relform_controller.ocp.problem import Ocp
from relform_controller.solver.solver import SqpStep
from relform_controller.solver.warm_start import hover_plan
from relform_core.scenario_config import ScenarioConfig
from support.compilers import Compiler, use_compiler
from support.problems import SOLVERS, Problem, random_problem, solver_of
from support.scenarios import paper_scenario, team_of

PRICES = "price_per_unit: 30, square_price_per_unit2: 100"
CONSTRAINTS = (
    "controller.constraints={"
    f"tilt: {{max_deg: 12, {PRICES}}}, speed: {{max_m_s: 1.0, {PRICES}}}, "
    f"separation: {{min_m: 1.3, {PRICES}}}, "
    "field_of_view: {axis_azimuth_deg: 10, axis_elevation_deg: 0, half_angle_deg: 40, range_max_m: 1.5, "
    f"pairs: [[follower_1, leader], [follower_2, leader]], {PRICES}}}, "
    f"keep_out: {{margin_m: 0.3, {PRICES}}}}}",
    "obstacles=[{kind: sphere, center_m: [0.5, 0.3, 1.5], radius_m: 0.3}, "
    "{kind: box, center_m: [1.0, -0.5, 1.0], size_m: [0.5, 0.5, 3.0], yaw_deg: 20.0}]",
)
LAG = "vehicle.rotor_time_constant_s=0.04"


def constrained(config: ScenarioConfig) -> Ocp:
    overrides = [f"vehicle.rotor_time_constant_s={config.vehicle.rotor_time_constant}"]
    return Ocp.from_config(
        paper_scenario(*team_of(len(config.team.vehicles)), *CONSTRAINTS, *overrides).config
    )


def steps(problem: Problem, ocp: Ocp, count: int) -> list[SqpStep]:
    """The last of some SQP steps from a hover, by each solver."""
    found = []
    geometry = problem.poses.geometry()
    for kind in SOLVERS:
        solver = solver_of(ocp, kind)
        plan = hover_plan(problem.start, problem.config.vehicle.hover_thrust, ocp.n_stages)
        for _ in range(count):
            solver.prepare(plan, geometry)
            step = solver.feedback(problem.start, geometry, problem.reference)
            plan = step.plan
        found.append(step)
    return found


@pytest.mark.parametrize("lag", [(), (LAG,)], ids=["no_lag", "lag"])
@pytest.mark.parametrize(("seed", "n_vehicles"), [(1, 2), (2, 3), (3, 5)])
def test_the_same_step(seed: int, n_vehicles: int, lag: tuple[str, ...]) -> None:
    problem = random_problem(seed, n_vehicles, *lag)
    kernel, reference = steps(problem, problem.ocp, 3)
    np.testing.assert_allclose(kernel.plan.thrusts, reference.plan.thrusts, atol=1e-8)
    np.testing.assert_allclose(kernel.plan.states, reference.plan.states, atol=1e-8)
    assert kernel.kkt == pytest.approx(reference.kkt, rel=1e-6)
    assert kernel.objective == pytest.approx(reference.objective, rel=1e-9)


@pytest.mark.parametrize("lag", [(), (LAG,)], ids=["no_lag", "lag"])
@pytest.mark.parametrize("seed", [2, 4])
def test_the_same_step_under_soft_constraints(seed: int, lag: tuple[str, ...]) -> None:
    problem = random_problem(seed, 3, *lag)
    ocp = constrained(problem.config)
    kernel, reference = steps(problem, ocp, 1)
    free, _ = steps(problem, problem.ocp, 1)
    assert np.abs(kernel.plan.thrusts - free.plan.thrusts).max() > 0.01, "some constraint matters"
    assert kernel.active_constraints == reference.active_constraints != ()
    assert free.active_constraints == ()
    np.testing.assert_allclose(kernel.plan.thrusts, reference.plan.thrusts, atol=1e-7)
    assert kernel.kkt == pytest.approx(reference.kkt, rel=1e-6)
    assert kernel.objective == pytest.approx(reference.objective, rel=1e-9)


@pytest.mark.skipif(
    not {"avx2", "fma"} <= set(Path("/proc/cpuinfo").read_text().split()), reason="the processor lacks AVX2"
)
def test_the_same_step_on_processors_that_have_no_more_than_avx2(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    compiler = Compiler(tmp_path, instead_of_native="-mavx2 -mfma")
    use_compiler(monkeypatch, tmp_path, compiler)
    problem = random_problem(4, 3, LAG)
    for ocp in (problem.ocp, constrained(problem.config)):
        kernel, reference = steps(problem, ocp, 1)
        np.testing.assert_allclose(kernel.plan.thrusts, reference.plan.thrusts, atol=1e-7)
        assert kernel.kkt == pytest.approx(reference.kkt, rel=1e-6)
    assert compiler.count > 0
