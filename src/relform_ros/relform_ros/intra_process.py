"""Messages between the nodes of one process, which need no transport."""

import time
from collections import defaultdict
from collections.abc import Callable, Iterable
from typing import Any


class IntraProcess:
    """Hands messages over between the nodes of one process, as soon as they are published.

    A topic is exchanged here if all its writers are in this process. Its readers in this process then have no
    subscription. They get the message object itself, which they must not change, or its serialized form.
    A reader gets the messages that are published after it has subscribed, on latched topics, too.
    """

    def __init__(self, nodes: Iterable[str]) -> None:
        self.nodes = frozenset(nodes)
        """Fully qualified names of the nodes of this process."""
        self._callbacks: defaultdict[str, list[Callable[[Any], None]]] = defaultdict(list)
        self._raw_callbacks: defaultdict[str, list[Callable[[bytes, int], None]]] = defaultdict(list)

    def exchanges(self, writers: Iterable[str]) -> bool:
        """Whether a topic with these writers is exchanged here."""
        return self.nodes.issuperset(writers)

    def subscribe(self, topic: str, callback: Callable[[Any], None]) -> None:
        """Read a topic that is exchanged here."""
        self._callbacks[topic].append(callback)

    def subscribe_raw(self, topic: str, callback: Callable[[bytes, int], None]) -> None:
        """Read the serialized messages of a topic that is exchanged here; callback as of ``raw``."""
        self._raw_callbacks[topic].append(callback)

    def wants_serialized(self, topic: str) -> bool:
        """Whether a reader in this process takes the serialized messages of a topic."""
        return topic in self._raw_callbacks

    def publish(self, topic: str, message: Any, data: bytes) -> None:
        """Hand a message to the readers in this process.

        Args:
            data: the message serialized, if a reader wants it.
        """
        if (raw_callbacks := self._raw_callbacks.get(topic)) is not None:
            publish_time_ns = time.time_ns()
            for raw_callback in raw_callbacks:
                raw_callback(data, publish_time_ns)
        for callback in self._callbacks.get(topic, ()):
            callback(message)
