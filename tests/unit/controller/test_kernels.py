"""The compiled kernels: where they are kept, when they are compiled, and the errors if that fails."""

import shutil
from pathlib import Path

import numpy as np
import pytest

from relform_controller import c_library
from relform_controller.ocp import layout
from relform_controller.ocp.problem import Ocp
from relform_controller.solver.make import make_solver
from relform_controller.solver.prediction import predictor
from relform_controller.solver.reference import ReferenceSolver
from relform_core.errors import RelformError
from support.problems import random_thrusts_of_team, simulate, solver_of
from support.scenarios import paper_scenario, team_of

SMALL = Ocp.from_config(paper_scenario(*team_of(2), "controller.horizon_steps=2").config)


class Compiler:
    """The machine's C compiler behind a script that counts how often it compiles."""

    def __init__(self, folder: Path) -> None:
        real = shutil.which("cc") or shutil.which("gcc")
        assert real is not None
        self.path = folder / "counting-cc"
        self._log = folder / "log"
        self.path.write_text(
            f'#!/bin/sh\n[ "$1" = --version ] || echo "$@" >> {self._log}\nexec {real} "$@"\n'
        )
        self.path.chmod(0o755)

    @property
    def count(self) -> int:
        return len(self._log.read_text().splitlines()) if self._log.exists() else 0


@pytest.fixture
def compiler(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Compiler:
    """With an empty cache, and a working folder that should stay empty."""
    compiler = Compiler(tmp_path)
    (tmp_path / "working").mkdir()
    (tmp_path / "temporary").mkdir()
    monkeypatch.chdir(tmp_path / "working")
    monkeypatch.setenv("CC", str(compiler.path))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setenv("TMPDIR", str(tmp_path / "temporary"))
    return compiler


def test_a_second_construction_compiles_nothing(compiler: Compiler, tmp_path: Path) -> None:
    predictor(SMALL)
    assert compiler.count == 1
    (library,) = (tmp_path / "cache/relform").iterdir()
    stamp = library.stat().st_mtime_ns
    predictor(SMALL)
    assert compiler.count == 1
    assert [library] == list((tmp_path / "cache/relform").iterdir())
    assert library.stat().st_mtime_ns == stamp


def test_another_problem_is_compiled_and_the_first_one_kept(compiler: Compiler, tmp_path: Path) -> None:
    predictor(SMALL)
    heavier = paper_scenario(*team_of(2), "controller.horizon_steps=2", "vehicle.mass_kg=0.8").config
    predictor(Ocp.from_config(heavier))
    assert compiler.count == 2
    assert len(list((tmp_path / "cache/relform").iterdir())) == 2
    predictor(SMALL)
    assert compiler.count == 2


def test_another_processor_needs_other_kernels(compiler: Compiler, monkeypatch: pytest.MonkeyPatch) -> None:
    """Home folders are shared between machines, and the code is compiled for one of them."""
    predictor(SMALL)
    monkeypatch.setattr(c_library, "_cpu", lambda: "another processor")
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


def test_nothing_is_left_outside_the_cache(compiler: Compiler, tmp_path: Path) -> None:
    predictor(SMALL)
    assert compiler.count == 1
    assert not list((tmp_path / "working").iterdir())
    assert not list((tmp_path / "temporary").iterdir())


def test_the_cache_of_the_user_is_the_default(
    compiler: Compiler, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("XDG_CACHE_HOME")
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    predictor(SMALL)
    assert len(list((tmp_path / "home/.cache/relform").iterdir())) == compiler.count == 1


def message_of_failure() -> str:
    with pytest.raises(RelformError) as caught:
        predictor(SMALL)
    (line,) = str(caught.value).splitlines()
    return line


def test_without_a_compiler_numpy_and_casadi_do_the_same_after_a_warning(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    thrusts = random_thrusts_of_team(5, SMALL, 1.75)[:, 0]
    states = np.random.default_rng(5).uniform(-0.5, 0.5, (2, layout.N_STATE))
    expected = predictor(SMALL)(states, thrusts)[0].copy()
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.delenv("CC", raising=False)
    with pytest.warns(
        RuntimeWarning, match=r"no C compiler found: install one \(apt install gcc\) or name it"
    ):
        (found,) = predictor(SMALL)(states, thrusts)
    np.testing.assert_allclose(found, expected, rtol=1e-13)
    with pytest.warns(RuntimeWarning, match="no C compiler found"):
        assert isinstance(make_solver(SMALL), ReferenceSolver)


def test_a_compiler_that_fails(compiler: Compiler, tmp_path: Path) -> None:
    compiler.path.write_text("#!/bin/sh\necho 'kernels.c:1: error: no such\n  register' >&2\nexit 1\n")
    assert message_of_failure() == (
        f"{compiler.path} cannot compile the kernels: kernels.c:1: error: no such register"
    )
    assert not (tmp_path / "cache").exists()


@pytest.mark.parametrize("cache", ["a-file", "/proc/relform", "n" * 300], ids=["file", "proc", "long"])
def test_a_cache_that_cannot_be_written(
    compiler: Compiler, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, cache: str
) -> None:
    (tmp_path / "a-file").write_text("")
    folder = tmp_path / cache
    monkeypatch.setenv("XDG_CACHE_HOME", str(folder))
    line = message_of_failure()
    assert line.startswith(f"{folder}/relform/kernels-")
    assert "cannot be written: " in line
    assert line.endswith("; set XDG_CACHE_HOME to another folder")


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
