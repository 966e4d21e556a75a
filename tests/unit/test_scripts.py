"""The files in scripts/ as a user starts them: with the right Python, and with another one."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

WORKSPACE = Path(__file__).parents[2]
SCRIPTS = sorted(path for path in WORKSPACE.glob("scripts/*.py") if path.name != "run_main.py")


def run(*command: Path | str, cwd: Path = WORKSPACE) -> subprocess.CompletedProcess[str]:
    return subprocess.run(command, cwd=cwd, capture_output=True, text=True, timeout=60)


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: path.stem)
def test_script_explains_itself_from_any_folder(script: Path, tmp_path: Path) -> None:
    finished = run(sys.executable, script, "--help", cwd=tmp_path)
    assert finished.returncode == 0, finished.stderr
    assert finished.stdout.startswith(f"usage: {script.stem} ")


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: path.stem)
def test_script_is_executable(script: Path) -> None:
    assert os.access(script, os.X_OK)


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: path.stem)
def test_python_without_relform_is_one_line_with_the_right_one(script: Path) -> None:
    finished = run(sys._base_executable, script.relative_to(WORKSPACE), "--help")
    assert (finished.returncode, finished.stdout) == (2, "")
    (line,) = finished.stderr.splitlines()
    assert line.startswith(f"error: this Python ({sys._base_executable}) has no relform_")
    assert line.endswith(f"run make setup once, then .venv/bin/python scripts/{script.name} --help")


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: path.stem)
def test_wrong_usage_is_one_line(script: Path) -> None:
    finished = run(sys.executable, script, "--wings")
    assert (finished.returncode, finished.stdout) == (2, "")
    (line,) = finished.stderr.splitlines()
    assert line.startswith("error: ")
    assert line.endswith(f"; see {script.stem} --help")
