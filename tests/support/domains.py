"""A ROS domain on this machine for tests, so that those that run in parallel do not meet."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import domain_coordinator
import pytest

THIS_MACHINE = Path(__file__).parents[2] / "setup/fastdds/this_machine.xml"


@contextmanager
def domain_of_tests() -> Iterator[int]:
    """A domain that this process and its children use, whatever the shell of the developer has set."""
    with domain_coordinator.domain_id() as domain, pytest.MonkeyPatch.context() as patch:
        patch.setenv("ROS_DOMAIN_ID", str(domain))
        patch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "SYSTEM_DEFAULT")
        patch.setenv("FASTRTPS_DEFAULT_PROFILES_FILE", str(THIS_MACHINE))
        patch.delenv("ROS_STATIC_PEERS", raising=False)
        yield domain
