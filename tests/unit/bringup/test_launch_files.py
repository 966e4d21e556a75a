"""Launch files, read as text: what they start exists. `test_launch.py` runs them where ROS has launch."""

import ast
import re
from pathlib import Path

import pytest

WORKSPACE = Path(__file__).parents[3]
BRINGUP = WORKSPACE / "src/relform_bringup"
LAUNCH_FILES = sorted((BRINGUP / "launch").glob("*.launch.py"))
FOREIGN = {("rviz2", "rviz2")}
PARAMETERS_OF_ROS = {"use_sim_time"}


def nodes(path: Path) -> list[dict[str, ast.expr]]:
    """The keywords of each ``Node(...)`` in a file."""
    return [
        {keyword.arg: keyword.value for keyword in call.keywords if keyword.arg is not None}
        for call in ast.walk(ast.parse(path.read_text()))
        if isinstance(call, ast.Call) and isinstance(call.func, ast.Name) and call.func.id == "Node"
    ]


def executables(package: str) -> set[str]:
    """Those that a package of ours installs."""
    entry_points = re.search(
        r'"console_scripts": \[(.*?)\]', (WORKSPACE / "src" / package / "setup.py").read_text(), re.DOTALL
    )
    assert entry_points is not None
    return set(re.findall(r'"([\w]+) = ', entry_points[1]))


def test_there_are_launch_files_for_a_flight_and_for_rviz() -> None:
    assert [path.name for path in LAUNCH_FILES] == ["flight.launch.py", "rviz.launch.py"]


@pytest.mark.parametrize("path", LAUNCH_FILES, ids=lambda path: path.name)
def test_their_executables_exist(path: Path) -> None:
    compile(path.read_text(), path, "exec")
    started = [
        (ast.literal_eval(node["package"]), ast.literal_eval(node["executable"])) for node in nodes(path)
    ]
    assert started
    for package, executable in started:
        assert (package, executable) in FOREIGN or executable in executables(package)


@pytest.mark.parametrize("path", LAUNCH_FILES, ids=lambda path: path.name)
def test_their_parameters_are_in_the_table_of_parameters(path: Path) -> None:
    documented = set(re.findall(r"`([\w.]+)`", (WORKSPACE / "docs/topics.md").read_text()))
    named = {
        ast.literal_eval(key)
        for part in ast.walk(ast.parse(path.read_text()))
        if isinstance(part, ast.Dict)
        for key in part.keys
        if key is not None
    }
    assert named <= documented | PARAMETERS_OF_ROS


def test_a_build_installs_all_of_them_and_the_layout_of_rviz() -> None:
    share = WORKSPACE / "install/relform_bringup/share/relform_bringup"
    installed = {path.name for folder in ("launch", "rviz") for path in (share / folder).iterdir()}
    assert installed == {"flight.launch.py", "rviz.launch.py", "relform.rviz"}
