"""A clean shell finds the workspace, sourced or not, in any folder and with any inherited environment."""

import os
import shutil
import subprocess
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path

import pytest

WORKSPACE = Path(__file__).parents[2]
PYTHON = WORKSPACE / ".venv/bin/python"
EXECUTABLES: dict[str, EntryPoint] = {
    entry.name: entry for entry in entry_points(group="console_scripts") if entry.value.startswith("relform_")
}
NODES = ("clock", "composed", "controller", "leader", "player", "quadrotor", "recorder", "visualization")
COMMANDS = (
    "accuracy", "bench", "bench_live", "bench_memory", "bench_real_time", "bench_ros", "bench_solver",
    "bound", "check_playback", "constraints", "export_path", "fly", "formation_changes", "foxglove",
    "live", "motions", "paper", "record", "replay", "report", "shapes",
    "sweep",
)  # fmt: skip

PROBE = """
import rclpy, relform_core, relform_msgs.msg
from ament_index_python import get_package_prefix

rclpy.init()
rclpy.create_node("probe").create_publisher(relform_msgs.msg.RotorSpeeds, "rotor_speeds", 1)
for place in rclpy.__file__, relform_core.__file__, relform_msgs.__file__, get_package_prefix("relform_sim"):
    print(place)
"""


def assert_finds_workspace(command: list[str | Path], tmp_path: Path, **environment: str) -> None:
    clean = {"HOME": os.environ["HOME"], "PATH": "/usr/bin:/bin", "ROS_LOG_DIR": str(tmp_path)}
    clean |= {"ROS_DOMAIN_ID": os.environ["ROS_DOMAIN_ID"]}
    run = subprocess.run(command, env=clean | environment, cwd="/", capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    places = run.stdout.splitlines()
    assert len(places) == 4
    assert [place for place in places if not Path(place).is_relative_to(WORKSPACE)] == []


@pytest.mark.parametrize("shell", ["bash", "sh", "zsh"])
def test_sourced(shell: str, tmp_path: Path) -> None:
    if shutil.which(shell, path="/usr/bin:/bin") is None:
        pytest.skip(f"no {shell} on this machine")
    script = f'. "$1/install/setup.{shell}" && python3 -c "$2"'
    assert_finds_workspace([shell, "-c", script, shell, WORKSPACE, PROBE], tmp_path)


def test_not_sourced(tmp_path: Path) -> None:
    assert_finds_workspace([PYTHON, "-c", PROBE], tmp_path)


def test_started_by_another_environment_of_ros_wheels(tmp_path: Path) -> None:
    inherited = {"_ROS_WHEELS_BOOTSTRAP_COMPLETE": "1", "LD_LIBRARY_PATH": "/elsewhere/lib"}
    assert_finds_workspace([PYTHON, "-c", PROBE], tmp_path, **inherited)


def test_another_ros_sourced(tmp_path: Path) -> None:
    other = tmp_path / "opt/ros/other"
    packages = other / "lib/python/site-packages"
    marker = other / "share/ament_index/resource_index/packages/rclpy"
    for file in (packages / "rclpy/__init__.py", marker):
        file.parent.mkdir(parents=True)
        file.write_text("raise ImportError('this rclpy belongs to another Python')\n")
    sourced = {"AMENT_PREFIX_PATH": str(other), "PYTHONPATH": str(packages)}
    assert_finds_workspace([PYTHON, "-c", PROBE], tmp_path, **sourced)


@pytest.mark.parametrize("name", NODES)
def test_node_is_where_ros2_run_looks(name: str, tmp_path: Path) -> None:
    run = run_executable(name, tmp_path)
    assert run.returncode == 1
    assert run.stderr.endswith(">\n")
    assert " is not set: add --ros-args -p " in run.stderr
    assert "Traceback" not in run.stderr


@pytest.mark.parametrize("name", COMMANDS)
def test_command_is_where_ros2_run_looks(name: str, tmp_path: Path) -> None:
    run = run_executable(name, tmp_path, "--help")
    assert (run.returncode, run.stderr) == (0, "")
    assert run.stdout.startswith(f"usage: {name} ")


def run_executable(name: str, folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Start an installed executable outside of the workspace."""
    package = EXECUTABLES[name].module.partition(".")[0]
    executable = WORKSPACE / "install" / package / "lib" / package / name
    environment = os.environ | {"ROS_LOG_DIR": str(folder)}
    command = [executable, *arguments]
    return subprocess.run(command, env=environment, cwd="/", capture_output=True, text=True, timeout=60)


def test_every_executable_is_known() -> None:
    assert sorted(EXECUTABLES) == sorted([*NODES, *COMMANDS])


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_has_a_script(name: str) -> None:
    assert f'run_main("{EXECUTABLES[name].module}")' in (WORKSPACE / f"scripts/{name}.py").read_text()
