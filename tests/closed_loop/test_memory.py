"""Long flights and many solvers need no more memory than short flights and one solver."""

import gc
import os
from collections.abc import Callable
from itertools import islice
from pathlib import Path

import pytest

from relform_analysis.flight.simulate import simulate
from relform_controller.solver.kernel import KernelSolver
from relform_controller.solver.reference import ReferenceSolver
from relform_controller.solver.warm_start import hover_plan
from relform_core.config_files import find_config
from support.problems import SOLVERS, random_problem, solver_of
from support.scenarios import paper_scenario

GROWTH_MAX = 1_000_000
"""Of the resident memory, after everything has been allocated once [bytes]."""


def growth(repeat: Callable[[int], None], n_before: int, n: int) -> int:
    """How much the resident memory grows over ``n`` repetitions, after others [bytes]."""
    repeat(n_before)
    before = resident()
    repeat(n)
    return resident() - before


def resident() -> int:
    gc.collect()
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGESIZE")


@pytest.mark.parametrize("controller", ["paper", "team"])
def test_flight(controller: str) -> None:
    steps = simulate(
        paper_scenario(f"controller={find_config('controller', controller)}", "phases.4.duration_s=100")
    )

    def fly(count: int) -> None:
        assert sum(1 for _ in islice(steps, count)) == count

    assert growth(fly, 800, 1000) < GROWTH_MAX


@pytest.mark.parametrize(("kind", "n"), [(KernelSolver, 2000), (ReferenceSolver, 50)])
def test_steps_of_a_solver(kind: type, n: int) -> None:
    problem = random_problem(1, 3)
    solver, geometry = solver_of(problem.ocp, kind), problem.poses.geometry()
    guess = hover_plan(problem.start, problem.config.vehicle.hover_thrust, problem.ocp.n_stages)

    def step(count: int) -> None:
        for _ in range(count):
            solver.prepare(guess, geometry)
            solver.feedback(problem.start, geometry, problem.reference)

    assert growth(step, n // 2, n) < GROWTH_MAX


@pytest.mark.parametrize("kind", SOLVERS)
def test_new_solvers(kind: type) -> None:
    ocp = random_problem(1, 3).ocp

    def make(count: int) -> None:
        for _ in range(count):
            solver_of(ocp, kind)

    assert growth(make, 4, 8) < GROWTH_MAX
