"""All packages: their manifests name what the code imports, and only some modules need ROS."""

import ast
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import pytest

SOURCES = Path(__file__).parents[2] / "src"
MANIFESTS = {path.parent.name: ElementTree.parse(path).getroot() for path in SOURCES.glob("*/package.xml")}
PYTHON_PACKAGES = sorted(path.parent.name for path in SOURCES.glob("*/setup.py"))

IMPORT_WITHOUT_ROS = """
import importlib, sys

class NoRos:
    def find_spec(self, name, path=None, target=None):
        package = name.partition(".")[0]
        if package in {"rclpy", "relform_ros"} or package.endswith(("_msgs", "_srvs", "_interfaces")):
            raise ImportError(f"{package} is out of bounds here")

sys.meta_path.insert(0, NoRos())
for name in sys.argv[1:]:
    importlib.import_module(name)
"""

# Under which key rosdep knows what Python imports; None where it does not.
ROSDEP_KEYS = {
    "argcomplete": "python3-argcomplete",
    "casadi": "casadi-pip",
    "distributed": None,  # optional: a sweep on a Dask cluster
    "jinja2": "python3-jinja2",
    "matplotlib": "python3-matplotlib",
    "mcap": None,
    "mcap_ros2": None,
    "mpl_toolkits": "python3-matplotlib",
    "numpy": "python3-numpy",
    "pydantic": "python3-pydantic",
    "pydantic_core": "python3-pydantic",
    "rich": "python3-rich",
    "ruamel": "python3-ruamel.yaml",
    "scipy": "python3-scipy",
    "threadpoolctl": "python3-threadpoolctl",
    "playwright": None,  # optional: bench_live
    "viser": None,
    "yaml": "python3-yaml",
    "zstandard": None,
}


def modules(package: str) -> dict[str, Path]:
    folder = SOURCES / package
    return {
        ".".join(path.relative_to(folder).with_suffix("").parts).removesuffix(".__init__"): path
        for path in folder.glob("relform_*/**/*.py")
    }


def imports(path: Path) -> set[str]:
    """Top-level names of everything that a file imports, in functions too."""
    names = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            names.add(node.module)
    return {name.partition(".")[0] for name in names}


def test_only_nodes_and_modules_from_bag_import_ros() -> None:
    pure = {
        name
        for package in PYTHON_PACKAGES
        if package not in {"relform_ros", "relform_cli"}
        for name in modules(package)
        if ".nodes." not in name and not name.endswith(".from_bag")
    }
    assert {"relform_core.errors", "relform_sim.plant", "relform_controller"} <= pure
    command = [sys.executable, "-c", IMPORT_WITHOUT_ROS, *sorted(pure)]
    run = subprocess.run(command, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr


@pytest.mark.parametrize("field", ["version", "license", "maintainer"])
def test_packages_agree(field: str) -> None:
    assert len({manifest.findtext(field) for manifest in MANIFESTS.values()}) == 1


@pytest.mark.parametrize("package", PYTHON_PACKAGES)
def test_setup_py_agrees_with_the_manifest(package: str) -> None:
    command = [sys.executable, "setup.py", "--quiet", "--name", "--version", "--license", "--description"]
    run = subprocess.run(command, cwd=SOURCES / package, capture_output=True, text=True, check=True)
    manifest = [MANIFESTS[package].findtext(field) for field in ("name", "version", "license", "description")]
    assert run.stdout.splitlines() == manifest


@pytest.mark.parametrize("package", ["relform_analysis", "relform_controller"])
def test_a_build_has_the_files_that_are_not_code(package: str, tmp_path: Path) -> None:
    """Such as the C code of kernels and the assets of reports; a build with links does not show it."""
    command = [sys.executable, "setup.py", "--quiet", "build", "--build-base", str(tmp_path)]
    subprocess.run(command, cwd=SOURCES / package, capture_output=True, check=True)
    source, built = SOURCES / package / package, tmp_path / "lib" / package
    names = {path.relative_to(source) for path in source.rglob("*.*") if "__pycache__" not in path.parts}
    assert names == {path.relative_to(built) for path in built.rglob("*.*")}


@pytest.mark.parametrize("package", PYTHON_PACKAGES)
def test_manifest_names_what_the_code_imports(package: str) -> None:
    """Stock ROS builds in the order of the manifests, and rosdep installs what they name."""
    imported = set().union(*map(imports, modules(package).values())) - sys.stdlib_module_names - {package}
    needed = {ROSDEP_KEYS.get(name, name) for name in imported} - {None}
    declared = {element.text for element in MANIFESTS[package] if element.tag.endswith("depend")}
    assert needed <= declared, f"add to src/{package}/package.xml: {sorted(needed - declared)}"
