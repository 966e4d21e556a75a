"""Start, waiting and end of every node of relform."""

import inspect
import re
import signal
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from types import FrameType
from typing import Any, Protocol

import rclpy
from rclpy.exceptions import ParameterException
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from rclpy.subscription import Subscription
from rclpy.utilities import try_shutdown

from relform_core.errors import ConfigError, FlightError, RelformError
from relform_core.exit_codes import NodeExit
from relform_core.ros_domain import wanted_domain
from relform_ros.parameters import warn_of_unknown

SIGNAL_LATENCY_S = 0.1
"""Longest time until a waiting node notices a signal."""

SILENCE = 0.5
"""Share of the waiting time without a message after which missed messages are looked for."""


class StopRequestedError(Exception):
    """SIGINT or SIGTERM arrived."""


class Runnable(Protocol):
    """The logic of a node."""

    def run(self) -> None:
        """Run to the end of the flight."""


class Spinner:
    """Lets the callbacks of one node run while its logic waits.

    ``EventsExecutor`` is the fastest executor, but its ``spin()`` ignores signals in the wheels of Jazzy;
    ``spin_once`` in a loop is as fast. It also misses a message that arrives while it registers for those of
    a topic, because rmw_fastrtps first counts the messages and then listens. So when no message comes for a
    while, the spinner takes missed messages from the subscriptions.
    """

    def __init__(self, node: Node, watch: Callable[[], None] | None = None) -> None:
        """Spin for a node; ``watch`` is called in every turn, and what it raises ends the waiting."""
        self._node = node
        self._executor = EventsExecutor(context=node.context)
        self._executor.add_node(node)
        self._watch = watch
        self._interrupted = False

    def interrupt(self, signum: int = 0, frame: FrameType | None = None) -> None:
        """Signal handler: end the waiting with ``StopRequestedError``."""
        self._interrupted = True

    def once(self, timeout_s: float = SIGNAL_LATENCY_S) -> None:
        """Run the next callback, or none if no message arrives in time.

        Raises:
            StopRequestedError: by a signal.
        """
        if self._interrupted:
            raise StopRequestedError
        if self._watch is not None:
            self._watch()
        self._spin_once(timeout_s)

    def close(self) -> None:
        """Release the node: until then it stays visible to others, even when it was destroyed."""
        self._executor.shutdown()

    def drain(self, duration_s: float) -> None:
        """Run callbacks for a while, even after a signal."""
        deadline = time.monotonic() + duration_s
        while (left := deadline - time.monotonic()) > 0.0:
            self._spin_once(left)

    def until(self, condition: Callable[[], bool]) -> None:
        """Run callbacks until a condition holds.

        Raises:
            StopRequestedError: by a signal.
        """
        while not condition():
            self.once()

    def _spin_once(self, timeout_s: float) -> None:
        began = time.monotonic()
        self._executor.spin_once(timeout_sec=timeout_s)
        if time.monotonic() - began > SILENCE * timeout_s:
            self._run_missed()

    def _run_missed(self) -> None:
        """Take all messages that have arrived, and run their callbacks."""
        for subscription in list(self._node.subscriptions):
            while (taken := _take(subscription)) is not None:
                # As rclpy does: the signature of a callback says whether it takes the info.
                n_arguments = len(inspect.signature(subscription.callback).parameters)
                subscription.callback(*taken[:n_arguments])


def _take(subscription: Subscription) -> tuple[Any, Any] | None:
    """The next message of a subscription and its info."""
    with subscription.handle:
        taken: tuple[Any, Any] | None = subscription.handle.take_message(
            subscription.msg_type, subscription.raw
        )
    return taken


def run_node(
    create: Callable[[], Node],
    build: Callable[[Node, Spinner], Runnable],
    exit_codes: Mapping[type[FlightError], int] | None = None,
    arguments: Sequence[str] | None = None,
) -> int:
    """Main function of a node's executable: returns its exit code.

    Args:
        create: makes the node, after ROS was initialised with the command line.
        build: makes the logic; it may take long, and a signal interrupts it anywhere.
        exit_codes: of errors that have their own; of any other error it is NodeExit.ERROR.
        arguments: of the node; None: the command line of the process.
    """
    name = sys.argv[0].rpartition("/")[2]
    try:
        # Before the logic runs, a signal ends the process immediately; later it ends the next waiting.
        for signum in (signal.SIGINT, signal.SIGTERM):
            signal.signal(signum, signal.default_int_handler)
        _initialize_ros(sys.argv[1:] if arguments is None else arguments)
        node = create()
        name = node.get_fully_qualified_name()
        spinner = Spinner(node)
        logic = build(node, spinner)
        warn_of_unknown(node)
        for signum in (signal.SIGINT, signal.SIGTERM):
            signal.signal(signum, spinner.interrupt)
        logic.run()
        return NodeExit.FLIGHT_OVER
    except RelformError as error:
        print(f"{name}: {error}", file=sys.stderr)
        return next(
            (code for kind, code in (exit_codes or {}).items() if isinstance(error, kind)), NodeExit.ERROR
        )
    except ParameterException as error:
        print(f"{name}: {error}", file=sys.stderr)
        return NodeExit.ERROR
    except (KeyboardInterrupt, StopRequestedError):
        return NodeExit.INTERRUPTED
    finally:
        try_shutdown()


def _initialize_ros(arguments: Sequence[str]) -> None:
    wanted_domain()  # the middleware would print an error of its own
    try:
        rclpy.init(args=[sys.argv[0], *arguments], signal_handler_options=SignalHandlerOptions.NO)
    except rclpy_implementation.RCLError as error:
        # Without the file names and lines of the sources of rcl.
        reason = re.sub(r", at \S+:\d+", "", " ".join(str(error).split()))
        raise ConfigError(
            f"ROS does not start: {reason.removeprefix('failed to initialize rcl: ')}"
        ) from None
