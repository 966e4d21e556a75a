"""Messages between the nodes of one process, which need no transport."""

from collections import defaultdict
from collections.abc import Callable, Iterable
from typing import Any


class IntraProcess:
    """Hands messages over between the nodes of one process, as soon as they are published.

    A topic is exchanged here if all its writers are in this process. Its readers in this process then have no
    subscription, and get the message object itself, which they must not change.
    """

    def __init__(self, nodes: Iterable[str]) -> None:
        self.nodes = frozenset(nodes)
        """Fully qualified names of the nodes of this process."""
        self._callbacks: defaultdict[str, list[Callable[[Any], None]]] = defaultdict(list)

    def exchanges(self, writers: Iterable[str]) -> bool:
        """Whether a topic with these writers is exchanged here."""
        return self.nodes.issuperset(writers)

    def subscribe(self, topic: str, callback: Callable[[Any], None]) -> None:
        """Read a topic that is exchanged here."""
        self._callbacks[topic].append(callback)

    def publish(self, topic: str, message: Any) -> None:
        """Hand a message to the readers in this process."""
        for callback in self._callbacks.get(topic, ()):
            callback(message)
