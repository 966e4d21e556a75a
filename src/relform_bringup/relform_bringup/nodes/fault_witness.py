"""A node of the fault campaign beside a flight: hears its clock."""

import time
from collections.abc import Callable
from types import TracebackType
from typing import Self

import rclpy
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rosgraph_msgs.msg import Clock

from relform_core.names import CLOCK
from relform_core.units import NANOSECONDS_PER_SECOND
from relform_ros.fields import stamp_from_msg
from relform_ros.qos import LOCKSTEP


class Witness:
    """Hears the clock of the flight in one domain; a context manager."""

    def __init__(self, domain_id: int) -> None:
        self._context = Context()
        rclpy.init(context=self._context, domain_id=domain_id)
        self.node = rclpy.create_node("witness", namespace="faults", context=self._context)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self.node)
        self.now = -1.0
        """Instant of the flight by its newest tick [s]; negative: it has not begun."""
        self.node.create_subscription(Clock, CLOCK, self._on_clock, LOCKSTEP)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._executor.shutdown()
        self.node.destroy_node()
        self._context.try_shutdown()

    def wait(self, condition: Callable[[], bool], timeout: float) -> bool:
        """Wait until a condition holds; returns whether it does within a time [s]."""
        deadline = time.monotonic() + timeout
        while not condition():
            if time.monotonic() > deadline:
                return False
            self._executor.spin_once(timeout_sec=0.02)
        return True

    def _on_clock(self, message: Clock) -> None:
        self.now = stamp_from_msg(message.clock) / NANOSECONDS_PER_SECOND
