"""DDS participants, which hold the nodes: how many run on this machine, and which of them are discovered."""

import socket
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from rclpy.node import Node

# The rules of RTPS (DDSI-RTPS 2.5, section 9.6.2.3) by which a participant chooses its port for discovery.
PORT_BASE = 7400
PORTS_PER_DOMAIN = 250
FIRST_OFFSET = 10
PORTS_PER_PARTICIPANT = 2

NAMES_TOPIC = "ros_discovery_info"
"""DDS topic on which each participant of ROS publishes which nodes it holds; its first publisher."""

UNKNOWN_NODE = "_NODE_NAME_UNKNOWN_"
"""What the middleware calls the node of an endpoint before it has received the node's name."""


def discovery_ports(domain_id: int, tables: Path = Path("/proc/net")) -> set[int]:
    """UDP ports for discovery that are open on this machine: one for each participant of a domain.

    Empty where the operating system has no such tables. A table is read in pieces, so entries can be skipped
    while other programs close sockets.
    """
    first = PORT_BASE + PORTS_PER_DOMAIN * domain_id + FIRST_OFFSET
    candidates = range(first, first + PORTS_PER_DOMAIN - FIRST_OFFSET, PORTS_PER_PARTICIPANT)
    ports = set()
    for name in ("udp", "udp6"):
        with suppress(OSError):
            for line in (tables / name).read_text().splitlines()[1:]:
                _, local_address, *_ = line.split()
                ports.add(int(local_address.rpartition(":")[2], 16))
    return ports.intersection(candidates)


class OpenPorts:
    """The discovery ports of a domain that are open on this machine, without those that a table skips."""

    def __init__(self, domain_id: int) -> None:
        self._domain_id = domain_id
        self._open: set[int] = set()

    def update(self) -> set[int]:
        """Look again; a port that the table no longer lists is closed only if it can be bound."""
        listed = discovery_ports(self._domain_id)
        self._open = listed | {port for port in self._open - listed if is_bound(port)}
        return self._open


def is_bound(port: int) -> bool:
    """Whether a program of this machine uses a UDP port."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.bind(("", port))
        except OSError:
            return True
    return False


@dataclass(frozen=True)
class Discovered:
    """The participants that a node has discovered, its own included, by the prefixes of their GUIDs."""

    participants: frozenset[bytes]
    nameless: frozenset[bytes]
    """Those of ROS whose nodes are not all known yet. Other DDS programs have no nodes."""


def discovered(node: Node) -> Discovered:
    endpoints = list(_endpoints(node))
    of_ros = {participant for topic, participant, _ in endpoints if topic == NAMES_TOPIC}
    nodes = {(participant, name) for topic, participant, name in endpoints if topic != NAMES_TOPIC}
    waiting = {participant for participant, name in nodes if name == UNKNOWN_NODE}
    nameless = of_ros & waiting | of_ros - {participant for participant, _ in nodes}
    return Discovered(frozenset(participant for _, participant, _ in endpoints), frozenset(nameless))


def n_of_ros(node: Node) -> int:
    """How many participants of ROS a node has discovered, its own included; fast."""
    return len(node.get_publishers_info_by_topic(NAMES_TOPIC, no_mangle=True))


def _endpoints(node: Node) -> Iterator[tuple[str, bytes, str]]:
    """DDS topic, participant and node of each publisher and subscription, those of services included."""
    for topic, _ in node.get_topic_names_and_types(no_demangle=True):
        for endpoint in (
            *node.get_publishers_info_by_topic(topic, no_mangle=True),
            *node.get_subscriptions_info_by_topic(topic, no_mangle=True),
        ):
            yield topic, bytes(endpoint.endpoint_gid[:12]), endpoint.node_name
