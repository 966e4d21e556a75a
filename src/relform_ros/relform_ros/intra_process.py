"""Messages between the nodes of one process, which need no transport."""

import time
from collections import defaultdict
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any


class IntraProcess:
    """Hands messages over between the nodes of one process, as soon as they are published.

    A topic is exchanged here if all its writers are in this process. Its readers in this process then have no
    subscription. They get the message itself or its content, which they must not change, or its serialized
    form. A reader gets the messages that are published after it has subscribed, on latched topics, too.
    """

    def __init__(self, nodes: Iterable[str]) -> None:
        self.nodes = frozenset(nodes)
        """Fully qualified names of the nodes of this process."""
        self._readers: defaultdict[str, list[_Reader]] = defaultdict(list)
        self._raw_callbacks: defaultdict[str, list[Callable[[bytes, int], None]]] = defaultdict(list)

    def exchanges(self, writers: Iterable[str]) -> bool:
        """Whether a topic with these writers is exchanged here."""
        return self.nodes.issuperset(writers)

    def subscribe(
        self, topic: str, callback: Callable[[Any], None], take_content: Callable[[Any], None] | None = None
    ) -> None:
        """Read a topic that is exchanged here.

        Args:
            callback: takes the message.
            take_content: takes its content instead, if the writer gives it.
        """
        self._readers[topic].append(_Reader(callback, take_content))

    def subscribe_raw(self, topic: str, callback: Callable[[bytes, int], None]) -> None:
        """Read the serialized messages of a topic that is exchanged here; callback as of ``raw``."""
        self._raw_callbacks[topic].append(callback)

    def wants_serialized(self, topic: str) -> bool:
        """Whether a reader in this process takes the serialized messages of a topic."""
        return topic in self._raw_callbacks

    def publish(self, topic: str, message: Any, data: bytes, content: Any = None) -> None:
        """Hand a message to the readers in this process.

        Args:
            data: the message serialized, if a reader wants it.
            content: what its readers decode from it; None: they get the message.
        """
        if (raw_callbacks := self._raw_callbacks.get(topic)) is not None:
            publish_time_ns = time.time_ns()
            for raw_callback in raw_callbacks:
                raw_callback(data, publish_time_ns)
        for reader in self._readers.get(topic, ()):
            if content is not None and reader.take_content is not None:
                reader.take_content(content)
            else:
                reader.callback(message)


@dataclass(frozen=True)
class _Reader:
    callback: Callable[[Any], None]
    take_content: Callable[[Any], None] | None
