"""setup/ros2 runs ros2cli if it finds one on the PATH, else relform_cli."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parents[3] / "setup/ros2"


def program(path: Path, says: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(f'#!/bin/sh\necho {says} "$@"\n')
    path.chmod(0o755)


@pytest.fixture
def environment(tmp_path: Path) -> Path:
    """The bin folder of a virtual environment with our script, in a folder with a space in its name."""
    folder = tmp_path / "a workspace/.venv/bin"
    program(folder / "python", "ours")
    shutil.copy(SCRIPT, folder / "ros2")
    return folder


def output(*path: Path, command: Path | str = "ros2") -> str:
    search = os.pathsep.join([*map(str, path), "/usr/bin", "/bin"])
    run = subprocess.run([command, "topic", "a b"], env={"PATH": search}, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    return run.stdout


OURS = "ours -P -m relform_cli topic a b\n"
REAL = "real topic a b\n"


def test_runs_ours_without_another_ros2(environment: Path) -> None:
    assert output(environment, command=environment / "ros2") == OURS
    assert output(command=environment / "ros2") == OURS


def test_runs_ours_through_a_link(environment: Path, tmp_path: Path) -> None:
    (tmp_path / "ros2").symlink_to(environment / "ros2")
    assert output(tmp_path, command=tmp_path / "ros2") == OURS


@pytest.mark.parametrize("ours_first", [True, False])
def test_runs_the_real_one_anywhere_on_the_path(environment: Path, tmp_path: Path, ours_first: bool) -> None:
    real = tmp_path / "opt/ros/jazzy/bin"
    program(real / "ros2", "real")
    path = [environment, real] if ours_first else [real, environment]
    assert output(*path, command=environment / "ros2") == REAL


def test_runs_the_real_one_of_the_same_environment(environment: Path) -> None:
    program(environment / "ros2", "real")  # as pip does
    assert output(environment, command=environment / "ros2") == REAL


def test_ignores_the_script_of_another_workspace(environment: Path, tmp_path: Path) -> None:
    other = tmp_path / "other/.venv/bin"
    program(other / "python", "another's")
    shutil.copy(SCRIPT, other / "ros2")
    assert output(other, environment, command=environment / "ros2") == OURS


def test_ignores_files_that_cannot_run(environment: Path, tmp_path: Path) -> None:
    (tmp_path / "folder/ros2").mkdir(parents=True)
    text = tmp_path / "text"
    text.mkdir()
    (text / "ros2").write_text("notes on ROS 2\n")
    assert output(tmp_path / "folder", text, environment, command=environment / "ros2") == OURS
