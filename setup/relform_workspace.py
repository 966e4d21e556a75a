"""Lets the Python of the virtual environment find this workspace, whatever the shell has sourced.

`make setup` puts this file into the site-packages of the environment, beside a .pth file that imports it
whenever that Python starts. It does what `source install/setup.bash` does for a shell. The dynamic linker
reads LD_LIBRARY_PATH only when a process begins, so Python restarts itself if the inherited one differs.
"""

import os
import sys
from pathlib import Path

WORKSPACE = Path(sys.prefix).parent
SITE_PACKAGES = Path(__file__).parent
RESTARTED_AS = "_RELFORM_RESTARTED_AS"  # holds the process id, which survives exec: no process restarts twice


def entries(variable: str) -> list[str]:
    return [entry for entry in os.environ.get(variable, "").split(os.pathsep) if entry]


def foreign_ros() -> list[Path]:
    """Prefixes of other ROS installations that were sourced; their rclpy does not work with our Python."""
    marker = "share/ament_index/resource_index/packages/rclpy"
    return [
        Path(entry)
        for entry in entries("AMENT_PREFIX_PATH")
        if Path(entry, marker).exists() and not Path(entry).samefile(sys.prefix)
    ]


def ours_first(ours: list[Path], variable: str, shunned: list[Path]) -> str:
    """The path list `variable` with `ours` in front and nothing from below the `shunned` prefixes."""
    first = [str(path) for path in ours]
    rest = [
        entry
        for entry in entries(variable)
        if entry not in first and not any(Path(entry).is_relative_to(prefix) for prefix in shunned)
    ]
    return os.pathsep.join(first + rest)


def choose_transport() -> None:
    """Stay on this machine unless ROS_AUTOMATIC_DISCOVERY_RANGE says otherwise (decision 29).

    With ``LOCALHOST`` rmw_fastrtps would add transports of its own; with ``SYSTEM_DEFAULT`` the profile
    decides. The user's own profile is left alone.
    """
    discovery, profile = "ROS_AUTOMATIC_DISCOVERY_RANGE", "FASTRTPS_DEFAULT_PROFILES_FILE"
    profiles = WORKSPACE / "setup/fastdds"
    this_machine, network = str(profiles / "this_machine.xml"), str(profiles / "network.xml")
    chosen, wanted = os.environ.get(profile) or None, os.environ.get(discovery) or "LOCALHOST"
    if chosen not in (None, this_machine, network):
        return
    if wanted == "LOCALHOST" or (wanted, chosen) == ("SYSTEM_DEFAULT", this_machine):
        os.environ.update({discovery: "SYSTEM_DEFAULT", profile: this_machine})
    else:
        os.environ[profile] = network


def activate() -> None:
    prefixes = sorted(index.parents[1] for index in WORKSPACE.glob("install/*/share/ament_index"))
    libraries = sorted({library.parent for library in WORKSPACE.glob("install/*/lib/*.so")})
    libraries += [Path(sys.prefix, "lib"), *sorted(SITE_PACKAGES.glob("ros_*.libs"))]
    shunned = foreign_ros()
    read_at_start = {
        "LD_LIBRARY_PATH": ours_first(libraries, "LD_LIBRARY_PATH", shunned),
        "PYTHONPATH": ours_first([], "PYTHONPATH", shunned),
    }
    choose_transport()
    os.environ["AMENT_PREFIX_PATH"] = ours_first([*prefixes, Path(sys.prefix)], "AMENT_PREFIX_PATH", shunned)

    restarted = os.environ.pop(RESTARTED_AS, None) == str(os.getpid())
    if not restarted and any(os.environ.get(name, "") != value for name, value in read_at_start.items()):
        os.environ.update(read_at_start, **{RESTARTED_AS: str(os.getpid())})
        os.execv(sys.executable, sys.orig_argv)

    packages = sorted(setup.parent for setup in WORKSPACE.glob("src/*/setup.py"))
    messages = sorted(WORKSPACE.glob("install/*_msgs/lib/python*/site-packages"))
    metadata = sorted(path.parent for path in WORKSPACE.glob("build/*/*.egg-info"))
    sys.path[:0] = [str(path) for path in [*packages, *messages]]
    sys.path.extend(str(path) for path in metadata)

    # The start-up hook of the wheels would restart Python too, unless this variable is set.
    # It must not stay set: child processes may run the Python of another environment.
    os.environ["_ROS_WHEELS_BOOTSTRAP_COMPLETE"] = "1"
    import ros_wheels_bootstrapper  # noqa: F401  (for the effect of importing it, here none)

    del os.environ["_ROS_WHEELS_BOOTSTRAP_COMPLETE"]


activate()
