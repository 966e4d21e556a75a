"""A ROS domain for each flight: the default domain of every shell, unless another flight has claimed it."""

import os
import socket
from collections.abc import Iterator
from contextlib import closing, contextmanager

from relform_core.errors import FlightError

DEFAULT_DOMAIN_ID = 0
"""The domain without ROS_DOMAIN_ID, so that a shell beside the flight sees its topics."""
DOMAIN_ID_MAX = 232
"""The ports of the next domain are beyond 65535, the last port that exists."""
DOMAIN_IDS = range(1, 102)
"""Domains of further flights; none of their ports is among those that Linux gives to clients."""
PARTICIPANTS_PROBED = 8
CLAIM = "\0relform-domain-"
"""Name in the abstract namespace of sockets: it has one holder, ends with its process and is not a file."""


@contextmanager
def claimed_domain(beside_shells: bool = True) -> Iterator[int]:
    """A domain id that no other flight on this machine uses.

    ROS_DOMAIN_ID decides if it is set. Otherwise it is the default domain, or, if another flight
    has claimed that, a domain without DDS participants.

    Args:
        beside_shells: whether it may be the default domain, which nodes of other shells use.
    Raises:
        FlightError: ROS_DOMAIN_ID is no domain, another flight uses it, or all domains are in use.
    """
    if (wanted := wanted_domain()) is not None:
        shared, candidates = [wanted], []
        problem = f"another flight uses ROS_DOMAIN_ID {wanted}; unset it to get a free one"
    else:
        first = os.getpid() % len(DOMAIN_IDS)  # flights that start together try different domains first
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


def wanted_domain() -> int | None:
    """The domain that ROS_DOMAIN_ID names; None: it is not set.

    Raises:
        FlightError: it is not a domain.
    """
    if not (text := os.environ.get("ROS_DOMAIN_ID")):
        return None
    if not text.isdecimal() or int(text) > DOMAIN_ID_MAX:
        bounds = f"a whole number from 0 to {DOMAIN_ID_MAX}"
        raise FlightError(f"ROS_DOMAIN_ID must be {bounds} (got '{text}'); change or unset it")
    return int(text)


def is_in_use(domain_id: int) -> bool:
    """Whether a DDS participant, or a test with ROS's domain_coordinator, uses a domain on this machine."""
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
