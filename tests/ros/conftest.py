"""Limit ROS tests to this machine and to a domain of their own, so that parallel runs do not meet."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from support.domains import domain_of_tests
from support.ros2_command import live_nodes_process


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    for item in items:
        if Path(__file__).parent in item.path.parents:
            item.add_marker(pytest.mark.ros)


@pytest.fixture(scope="session", autouse=True)
def isolated_ros() -> Iterator[None]:
    with domain_of_tests():
        yield


@pytest.fixture(scope="session")
def live_nodes() -> Iterator[dict[str, str]]:
    """The environment of a shell where live_nodes.py runs and ros2 is ours."""
    with live_nodes_process() as (_, environment):
        yield environment
