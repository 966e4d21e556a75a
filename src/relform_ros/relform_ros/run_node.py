"""How every node of relform starts, waits and ends."""

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
from relform_ros.parameters import warn_of_unknown

EXIT_ERROR = 1
EXIT_INTERRUPTED = 130
"""As of a shell whose command ended by Ctrl-C. A node that exits with 0 has seen the end of the flight."""

SIGNAL_LATENCY_S = 0.1
"""How long a signal may go unnoticed while nothing else happens."""

SILENCE = 0.5
"""Share of a waiting time after which nothing seems to come."""


class StopRequestedError(Exception):
    """SIGINT or SIGTERM arrived."""


class Runnable(Protocol):
    """A node's logic, which waits with the spinner it was built with."""

    def run(self) -> None:
        """Run to the end of the flight."""


class Spinner:
    """Lets the callbacks of one node run while its logic waits.

    ``EventsExecutor`` is the fastest executor, but its ``spin()`` ignores signals in the wheels of Jazzy;
    ``spin_once`` in a loop is as fast. And it never hears of a message that arrives just while it registers
    for those of a topic, for rmw_fastrtps first counts what is there and then listens: in silence, what was
    missed is looked for.
    """

    def __init__(self, node: Node, watch: Callable[[], None] | None = None) -> None:
        """Spin for a node; ``watch`` is called at every turn, and ends the waiting with what it raises."""
        self._node = node
        self._executor = EventsExecutor(context=node.context)
        self._executor.add_node(node)
        self._watch = watch
        self._interrupted = False

    def interrupt(self, signum: int = 0, frame: FrameType | None = None) -> None:
        """Let the waiting end with ``StopRequestedError``; a signal handler."""
        self._interrupted = True

    def once(self, timeout_s: float = SIGNAL_LATENCY_S) -> None:
        """Run the next callback, or none if nothing arrives in time.

        Raises:
            StopRequestedError: by a signal.
        """
        if self._interrupted:
            raise StopRequestedError
        if self._watch is not None:
            self._watch()
        self._spin_once(timeout_s)

    def drain(self, duration_s: float) -> None:
        """Run callbacks for a while, even after a signal."""
        deadline = time.monotonic() + duration_s
        while (left := deadline - time.monotonic()) > 0.0:
            self._spin_once(left)

    def until(self, condition: Callable[[], bool]) -> None:
        """Run callbacks until a condition holds that they bring about.

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
        """Run the callbacks of all messages that are there to be taken, whether they were heard of or not."""
        for subscription in list(self._node.subscriptions):
            while (taken := _take(subscription)) is not None:
                # Whether a callback wants the info, rclpy sees by its signature, too.
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
        build: makes the logic; may take long, a signal breaks it off anywhere.
        exit_codes: of errors that have their own; of any other error it is EXIT_ERROR.
        arguments: of the node; None: the command line of the process.
    """
    name = sys.argv[0].rpartition("/")[2]
    try:
        # Until the logic runs, a signal may end everything at once; then it waits for the logic to wait.
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
        return 0
    except RelformError as error:
        print(f"{name}: {error}", file=sys.stderr)
        return next(
            (code for kind, code in (exit_codes or {}).items() if isinstance(error, kind)), EXIT_ERROR
        )
    except ParameterException as error:
        print(f"{name}: {error}", file=sys.stderr)
        return EXIT_ERROR
    except (KeyboardInterrupt, StopRequestedError):
        return EXIT_INTERRUPTED
    finally:
        try_shutdown()


def _initialize_ros(arguments: Sequence[str]) -> None:
    try:
        rclpy.init(args=[sys.argv[0], *arguments], signal_handler_options=SignalHandlerOptions.NO)
    except rclpy_implementation.RCLError as error:
        # Without the places in the sources of rcl.
        reason = re.sub(r", at \S+:\d+", "", " ".join(str(error).split()))
        raise ConfigError(
            f"ROS does not start: {reason.removeprefix('failed to initialize rcl: ')}"
        ) from None
