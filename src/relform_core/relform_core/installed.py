"""Find installed executables, and the versions of the software that flies."""

import platform
import subprocess
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from xml.etree import ElementTree

from ament_index_python.packages import PackageNotFoundError as RosPackageNotFoundError
from ament_index_python.packages import get_package_prefix, get_package_share_directory

from relform_core.errors import FlightError

LIBRARIES = ("casadi", "mcap", "numpy", "pydantic", "scipy")
ROS_PACKAGES = (
    "rclpy",
    "rmw_fastrtps_cpp",
    "geometry_msgs",
    "nav_msgs",
    "sensor_msgs",
    "std_msgs",
    "relform_msgs",
)


def executable(package: str, name: str) -> str:
    """Path of a node's executable in its installed package.

    Raises:
        FlightError: it is not installed.
    """
    try:
        path = Path(get_package_prefix(package), "lib", package, name)
    except RosPackageNotFoundError:
        raise FlightError(f"package {package} is not installed: run make setup") from None
    if not path.exists():
        raise FlightError(f"{path}: no such file: run make setup")
    return str(path)


def software_versions() -> dict[str, str | None]:
    """Versions by name; None for what is not installed, and for the commit outside of a git checkout."""
    return {
        "relform": _ros_package_version("relform_core"),
        "git_commit": _git_commit(),
        "python": platform.python_version(),
        "platform": platform.platform(),
        **{name: _library_version(name) for name in LIBRARIES},
        **{name: _ros_package_version(name) for name in ROS_PACKAGES},
    }


def _library_version(name: str) -> str | None:
    try:
        return version(name)
    except PackageNotFoundError:
        return None


def _ros_package_version(name: str) -> str | None:
    try:
        manifest = Path(get_package_share_directory(name), "package.xml")
        return ElementTree.parse(manifest).getroot().findtext("version")
    except (RosPackageNotFoundError, OSError, ElementTree.ParseError):
        return None


def _git_commit() -> str | None:
    """Commit of the sources, with ``-dirty`` if they differ from it."""
    command = ["git", "describe", "--always", "--dirty", "--abbrev=40", "--exclude=*"]
    try:
        run = subprocess.run(
            command, cwd=Path(__file__).parent, capture_output=True, text=True, timeout=5.0, check=True
        )
    except (OSError, subprocess.SubprocessError):
        return None
    return run.stdout.strip()
