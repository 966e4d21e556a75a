"""How a node checks its name and finds the others before a flight."""

import math
import sys
import time
from collections.abc import Callable, Collection, Sequence

from relform_core.errors import ConfigError
from relform_ros.endpoints import Endpoints
from relform_ros.spinner import until

DISCOVERY_POLL_S = 0.01
"""No event wakes a node when its picture of the graph changes, so during discovery it polls this often."""
DISCOVERY_PATIENCE_S = 5.0
"""After this time a node prints which nodes it is waiting for. It keeps waiting; only the clock gives up."""


async def discover(
    name: str,
    endpoints: Endpoints,
    is_ready: Callable[[], bool] = lambda: True,
    spare: Callable[[], Collection[str]] = tuple,
) -> None:
    """Wait until a node's partners are connected and it is ready; name the missing ones once, after a while.

    Args:
        name: of the node.
        endpoints: its topics.
        is_ready: whether there is nothing else to wait for; what it raises ends the waiting.
        spare: the nodes that may be missing.
    Raises:
        StopRequestedError: by a signal.
    """
    deadline = time.monotonic() + DISCOVERY_PATIENCE_S
    unmatched: set[str] | None = None

    def is_over() -> bool:
        nonlocal deadline, unmatched
        unmatched = endpoints.unmatched(among=unmatched)
        if unmatched and (missing_ones := set(spare())):
            unmatched = {topic for topic in unmatched if not endpoints.lacks_only(topic, missing_ones)}
        if unmatched and time.monotonic() > deadline:
            deadline = math.inf
            absent = {node for topic in unmatched for node in endpoints.absent(topic)}
            awaited = absent or {node for topic in unmatched for node in endpoints.partners(topic)}
            print(f"{name}: still waiting for {', '.join(sorted(awaited))}", file=sys.stderr)
        return is_ready() and not unmatched

    await until(is_over, DISCOVERY_POLL_S)


def check_name(name: str, known: Sequence[str]) -> None:
    """Check that a node has a name by which the others find it.

    Raises:
        ConfigError: it has not.
    """
    if name not in known:
        raise ConfigError(
            f"unknown node name {name}, expected one of {', '.join(known)}: start the node without "
            "-r __node:=, and with -r __ns:= only for the namespace of a vehicle or controller"
        )
