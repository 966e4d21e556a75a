"""How the ros2 command discovers the graph, and what it prints when nodes do not answer."""

import signal
import socket
from collections.abc import Iterator
from pathlib import Path

import pytest

from relform_cli import participants
from relform_cli.participants import OpenPorts, discovery_ports
from support.ros2_command import Answer, ask, live_nodes_process

NODES = "/alpha/listener\n/alpha/talker\n"


@pytest.fixture
def stopped_nodes() -> Iterator[tuple[int, dict[str, str]]]:
    """The id of a stopped process of live_nodes.py, and the environment of its domain."""
    with live_nodes_process() as (nodes, environment):
        nodes.send_signal(signal.SIGSTOP)
        yield nodes.pid, environment


def test_list_waits_for_slow_nodes(stopped_nodes: tuple[int, dict[str, str]], tmp_path: Path) -> None:
    pid, environment = stopped_nodes
    answer = ask(f"(sleep 4; kill -CONT {pid}) & ros2 node list", environment, tmp_path)
    assert answer == Answer(NODES, "", 0)


@pytest.mark.parametrize(
    "verb", ["node list", "topic find std_msgs/msg/String", "service list", "param list"]
)
def test_list_names_what_is_missing(
    stopped_nodes: tuple[int, dict[str, str]], tmp_path: Path, verb: str
) -> None:
    _, environment = stopped_nodes
    hint = "1 of 2 ROS processes on this machine have not answered after 8 s"
    way_out = "--spin-time SECONDS sets how long to wait"
    answer = ask(f"ros2 {verb}", environment, tmp_path)
    assert answer == Answer("", f"The list may be incomplete: {hint}; {way_out}\n", 0)


TABLE_HEADING = (
    "  sl  local_address rem_address   st tx_queue rx_queue tr tm->when retrnsmt   uid  timeout inode\n"
)


def table_line(address: str, port: int) -> str:
    return f" 1: {address}:{port:04X} 00000000:0000 07 00000000:00000000 00:00000000 00000000 0 0 1 2 0 0\n"


def test_discovery_ports_of_one_domain(tmp_path: Path) -> None:
    # Domain 3: multicast, two participants with two ports each; another domain; another program.
    ports = [8150, 8160, 8161, 8162, 8163, 8410, 53]
    (tmp_path / "udp").write_text(TABLE_HEADING + "".join(table_line("00000000", port) for port in ports))
    (tmp_path / "udp6").write_text(TABLE_HEADING + table_line("0" * 32, 8164))
    assert discovery_ports(3, tmp_path) == {8160, 8162, 8164}
    assert discovery_ports(4, tmp_path) == {8410}


def test_no_tables(tmp_path: Path) -> None:
    assert discovery_ports(3, tmp_path) == set()


def test_a_port_is_open_until_it_can_be_bound(monkeypatch: pytest.MonkeyPatch) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as program:
        port = 7400 + 250 * 101 + 10  # of a domain that no test uses
        program.bind(("", port))
        ports = OpenPorts(101)
        assert port in ports.update()
        monkeypatch.setattr(participants, "discovery_ports", lambda _: set())  # a table that skips the entry
        assert port in ports.update()
    assert port not in ports.update()
