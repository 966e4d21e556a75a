"""ROS tests hear this machine only, in a domain of their own: runs side by side do not disturb each other."""

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import domain_coordinator
import pytest


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    for item in items:
        if Path(__file__).parent in item.path.parents:
            item.add_marker(pytest.mark.ros)


@pytest.fixture(scope="session", autouse=True)
def isolated_ros() -> Iterator[None]:
    with domain_coordinator.domain_id() as domain, pytest.MonkeyPatch.context() as patch:
        patch.setenv("ROS_DOMAIN_ID", str(domain))
        patch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
        patch.delenv("ROS_STATIC_PEERS", raising=False)
        yield


@pytest.fixture(scope="session")
def live_nodes() -> Iterator[dict[str, str]]:
    """The environment of a shell in which live_nodes.py runs, and ros2 is ours."""
    with domain_coordinator.domain_id() as domain:
        python = Path(sys.executable)
        environment = {**os.environ, "ROS_DOMAIN_ID": str(domain), "PATH": f"{python.parent}:/usr/bin:/bin"}
        nodes = subprocess.Popen(
            [python, Path(__file__).with_name("live_nodes.py")],
            env=environment,
            stdout=subprocess.PIPE,
            text=True,
        )
        with nodes:
            assert nodes.stdout is not None
            assert nodes.stdout.readline() == "ready\n"
            yield environment
            nodes.kill()
