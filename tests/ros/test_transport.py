"""Nodes listen on this machine only, unless the user asks for more (docs/decisions/0029-transport.md)."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

PROFILES = Path(__file__).parents[2] / "setup/fastdds"
PROBE = """
import os
from pathlib import Path
import rclpy

rclpy.init()
node = rclpy.create_node("probe")
files = {os.readlink(path) for path in Path("/proc/self/fd").iterdir() if path.is_symlink()}
sockets = [line.split() for line in open("/proc/net/udp")][1:]
print(Path(os.environ["FASTRTPS_DEFAULT_PROFILES_FILE"]).name)
print(*sorted({socket[1].partition(":")[0] for socket in sockets if f"socket:[{socket[9]}]" in files}))
print("/dev/shm/fast" in open("/proc/self/maps").read())
"""
LOOPBACK, ANY = "0100007F", "00000000"
"""IPv4 addresses as in /proc/net/udp."""


def probe(**changes: str) -> tuple[str, set[str], str]:
    """The profile of a node's process, the addresses on which it listens, and whether it shares memory."""
    environment = {
        "PATH": "/usr/bin:/bin",
        "HOME": os.environ["HOME"],
        "ROS_DOMAIN_ID": os.environ["ROS_DOMAIN_ID"],
    }
    run = subprocess.run(
        [sys.executable, "-c", PROBE],
        env=environment | changes,
        capture_output=True,
        text=True,
        check=True,
    )
    profile, addresses, shares_memory = run.stdout.splitlines()
    return profile, set(addresses.split()), shares_memory


@pytest.mark.parametrize("wanted", ["", "LOCALHOST"])
def test_nodes_listen_on_the_loopback_interface(wanted: str) -> None:
    assert probe(ROS_AUTOMATIC_DISCOVERY_RANGE=wanted) == ("this_machine.xml", {LOOPBACK}, "False")


@pytest.mark.parametrize("wanted", ["SUBNET", "SYSTEM_DEFAULT"])
def test_a_user_can_open_the_network(wanted: str) -> None:
    profile, addresses, shares_memory = probe(ROS_AUTOMATIC_DISCOVERY_RANGE=wanted)
    assert (profile, shares_memory) == ("network.xml", "False")
    assert ANY in addresses


def test_children_of_a_node_stay_on_this_machine() -> None:
    """They inherit what their parent has set."""
    inherited = {
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "SYSTEM_DEFAULT",
        "FASTRTPS_DEFAULT_PROFILES_FILE": str(PROFILES / "this_machine.xml"),
    }
    assert probe(**inherited) == ("this_machine.xml", {LOOPBACK}, "False")


def test_the_profile_of_a_user_is_left_alone(tmp_path: Path) -> None:
    profile = tmp_path / "mine.xml"
    profile.write_bytes((PROFILES / "network.xml").read_bytes())
    assert probe(FASTRTPS_DEFAULT_PROFILES_FILE=str(profile))[0] == "mine.xml"
