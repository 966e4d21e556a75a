"""A ROS domain of its own for each flight: that of every shell, unless another flight has it already."""

import os
import socket
from collections.abc import Iterator
from contextlib import closing, contextmanager

from relform_core.errors import FlightError

DEFAULT_DOMAIN_ID = 0
"""Where ROS is without ROS_DOMAIN_ID: so a shell beside the flight sees its topics."""
DOMAIN_IDS = range(1, 102)
"""For more flights at once; no ports among those that Linux gives to clients."""
PARTICIPANTS_PROBED = 8
CLAIM = "\0relform-domain-"
"""A name in the abstract namespace: one holder at a time, gone with its process, never a file."""


@contextmanager
def claimed_domain(beside_shells: bool = True) -> Iterator[int]:
    """A domain id that no other flight on this machine uses.

    ROS_DOMAIN_ID, if it is set, is what the user wants. Otherwise it is the default one, or,
    where another flight has that, one that no DDS participant uses.

    Args:
        beside_shells: whether the default domain will do, where every shell and its nodes are.
    Raises:
        FlightError: another flight uses the domain that the user wants, or all are in use.
    """
    if wanted := os.environ.get("ROS_DOMAIN_ID"):
        if not wanted.isdecimal():
            raise FlightError(f"ROS_DOMAIN_ID must be a number (got '{wanted}'); unset it to get a free one")
        shared, candidates = [int(wanted)], []
        problem = f"another flight uses ROS_DOMAIN_ID {wanted}; unset it to get a free one"
    else:
        first = os.getpid() % len(DOMAIN_IDS)  # flights that start at once do not all begin at the same one
        shared = [DEFAULT_DOMAIN_ID] if beside_shells else []
        candidates = [*DOMAIN_IDS[first:], *DOMAIN_IDS[:first]]
        problem = f"all ROS domains from {DOMAIN_IDS[0]} to {DOMAIN_IDS[-1]} are in use; set ROS_DOMAIN_ID"
    for domain_id in (*shared, *candidates):
        if domain_id not in shared and is_in_use(domain_id):
            continue
        with closing(socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)) as claim:
            try:
                claim.bind(f"{CLAIM}{domain_id}")
            except OSError:
                continue
            yield domain_id
            return
    raise FlightError(problem)


def is_in_use(domain_id: int) -> bool:
    """Whether a DDS participant on this machine has a domain, or a test by ROS's domain_coordinator."""
    first = 7400 + 250 * domain_id + 10  # DDSI-RTPS 9.6.1.1: PB + DG * domain + d1 + PG * participant
    participants = (_is_taken(first + 2 * n, socket.SOCK_DGRAM) for n in range(PARTICIPANTS_PROBED))
    return any(participants) or _is_taken(32768 + domain_id, socket.SOCK_STREAM)


def _is_taken(port: int, kind: socket.SocketKind) -> bool:
    with closing(socket.socket(socket.AF_INET, kind)) as probe:
        try:
            probe.bind(("", port))
        except OSError:
            return True
    return False
