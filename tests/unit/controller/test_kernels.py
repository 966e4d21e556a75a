"""The compiled kernels: what needs a compilation, and what is done without a compiler."""

from pathlib import Path

import numpy as np
import pytest

from relform_controller.ocp import layout
from relform_controller.ocp.problem import Ocp
from relform_controller.solver.make import make_solver
from relform_controller.solver.prediction import predictor
from relform_controller.solver.reference import ReferenceSolver
from support.compilers import Compiler, use_compiler
from support.problems import random_thrusts_of_team, simulate, solver_of
from support.scenarios import paper_scenario, team_of

SMALL = Ocp.from_config(paper_scenario(*team_of(2), "controller.horizon_steps=2").config)


@pytest.fixture
def compiler(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Compiler:
    """With an empty cache."""
    compiler = Compiler(tmp_path)
    use_compiler(monkeypatch, tmp_path, compiler)
    return compiler


def test_another_problem_is_compiled_and_the_first_one_kept(compiler: Compiler) -> None:
    predictor(SMALL)
    heavier = paper_scenario(*team_of(2), "controller.horizon_steps=2", "vehicle.mass_kg=0.8").config
    predictor(Ocp.from_config(heavier))
    assert compiler.count == 2
    predictor(SMALL)
    assert compiler.count == 2


def test_one_compilation_serves_all_weights_bounds_horizons_and_team_sizes(compiler: Compiler) -> None:
    solver_of(SMALL)
    other = paper_scenario(
        *team_of(4),
        "controller.horizon_steps=5",
        "controller.weights.formation_per_m2=3",
        "vehicle.rotor_speed_max_rpm=5500",
    )
    solver_of(Ocp.from_config(other.config))
    assert compiler.count == 1


def test_without_a_compiler_numpy_and_casadi_do_the_same_after_a_warning(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    thrusts = random_thrusts_of_team(5, SMALL, 1.75)[:, 0]
    states = np.random.default_rng(5).uniform(-0.5, 0.5, (2, layout.N_STATE))
    expected = predictor(SMALL)(states, thrusts)[0].copy()
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.delenv("CC", raising=False)
    with pytest.warns(RuntimeWarning, match="no C compiler found"):
        (found,) = predictor(SMALL)(states, thrusts)
    np.testing.assert_allclose(found, expected, rtol=1e-13)
    with pytest.warns(RuntimeWarning, match="no C compiler found"):
        assert isinstance(make_solver(SMALL), ReferenceSolver)


def test_one_call_evaluates_all_items_and_outputs_are_used_again() -> None:
    predict = predictor(SMALL)
    generator = np.random.default_rng(5)
    states = generator.uniform(-0.5, 0.5, (2, layout.N_STATE))
    thrusts = random_thrusts_of_team(5, SMALL, 1.75)[:, 0]
    (following,) = predict(states, thrusts)
    first = following.copy()
    np.testing.assert_allclose(first, simulate(SMALL, states, thrusts[:, None])[:, 1], atol=1e-13)
    (again,) = predict(states[::-1], thrusts[::-1])
    assert again is following
    np.testing.assert_array_equal(again, first[::-1])
