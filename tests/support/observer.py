"""A node of the test among the nodes of a flight."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, Self

import rclpy
from rclpy.client import Client
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node

from relform_ros.qos import LOCKSTEP

ANSWER_S = 5.0
"""How long to wait for an answer."""


class Observer:
    """Reads topics and calls services in one domain."""

    def __init__(self, domain_id: int) -> None:
        self._context = Context()
        rclpy.init(context=self._context, domain_id=domain_id)
        self.node: Node = rclpy.create_node("observer", context=self._context)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self.node)
        self._clients: dict[str, Client] = {}

    @classmethod
    @contextmanager
    def running(cls, domain_id: int) -> Iterator[Self]:
        observer = cls(domain_id)
        try:
            yield observer
        finally:
            observer.close()

    @property
    def nodes(self) -> set[str]:
        """Fully qualified names of the nodes that it sees."""
        found = self.node.get_node_names_and_namespaces()
        return {f"{namespace.rstrip('/')}/{name}" for name, namespace in found}

    def collect(self, type_: Any, topic: str, qos: Any = LOCKSTEP) -> list[Any]:
        """A list that fills with the messages of a topic."""
        messages: list[Any] = []
        self.node.create_subscription(type_, topic, messages.append, qos)
        return messages

    def call(self, type_: Any, service: str, request: Any) -> Any:
        """Call a service and wait for its answer.

        It asks again if need be: a server that does not know of the client yet loses its answer.
        """
        client = self._clients.get(service) or self.node.create_client(type_, service)
        self._clients[service] = client
        self.until(client.service_is_ready)
        asked, futures = 0.0, []

        def answered() -> bool:
            nonlocal asked
            if time.monotonic() > asked + ANSWER_S:
                asked = time.monotonic()
                futures.append(client.call_async(request))
            return any(future.done() for future in futures)

        self.until(answered)
        return next(future.result() for future in futures if future.done())

    def until(self, condition: Callable[[], bool], timeout_s: float = 60.0) -> None:
        deadline = time.monotonic() + timeout_s
        while not condition():
            assert time.monotonic() < deadline, "waited in vain"
            self._executor.spin_once(timeout_sec=0.05)

    def close(self) -> None:
        self._executor.shutdown()
        self.node.destroy_node()
        self._context.try_shutdown()
