"""A pipe through which a node hands the messages of each step to the process that has started it."""

from collections.abc import Sequence
from multiprocessing.connection import Connection
from types import TracebackType
from typing import Self

from rclpy.node import Node

from relform_ros.parameters import read_only
from relform_ros.spinner import StopRequestedError

StepMessages = Sequence[tuple[str, bytes]]
"""The messages of a step: topic and data."""
PIPE = "pipe"
"""Parameter of the node that writes."""
NO_PIPE = -1


class StepPipe:
    """The end that writes; a context manager. Whoever reads gets each step whole, or nothing of it."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._connection.close()

    def send(self, messages: StepMessages) -> None:
        """Hand a step over; waits while the pipe is full.

        Raises:
            StopRequestedError: the reader has closed it, or has ended.
        """
        try:
            self._connection.send(messages)
        except BrokenPipeError:
            raise StopRequestedError from None


def read_step_pipe(node: Node) -> StepPipe | None:
    """The pipe that the parameter ``pipe`` names; None: it names none.

    Raises:
        ConfigError: its value has the wrong type.
    """
    number = read_only(node, PIPE, NO_PIPE, "Number of the file to which fly listens; only fly can set it.")
    return None if number == NO_PIPE else StepPipe(Connection(number, readable=False))
