"""Start and end of every node of relform."""

import gc
import re
import signal
import sys
from collections.abc import Callable, Mapping, Sequence
from typing import Protocol

import rclpy
from rclpy.exceptions import ParameterException
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import try_shutdown

from relform_core.errors import ConfigError, FlightError, RelformError
from relform_core.exit_codes import NodeExit
from relform_core.ros_domain import wanted_domain
from relform_ros.parameters import warn_of_unknown
from relform_ros.spinner import Spinner, StopRequestedError


class Runnable(Protocol):
    """The logic of a node."""

    async def run(self) -> None:
        """Run to the end of the flight; see ``spinner.Logic``."""


Build = Callable[[Node, Spinner], Runnable]
"""Makes the logic of a node; it may take long, and a signal interrupts it anywhere."""


def run_node(
    create: Callable[[], Node],
    build: Build,
    exit_codes: Mapping[type[FlightError], int] | None = None,
    arguments: Sequence[str] | None = None,
) -> int:
    """Main function of the executable of one node: returns its exit code. See ``run_nodes``."""
    return run_nodes(lambda: [(create(), build)], exit_codes, arguments)


def run_nodes(
    create: Callable[[], Sequence[tuple[Node, Build]]],
    exit_codes: Mapping[type[FlightError], int] | None = None,
    arguments: Sequence[str] | None = None,
) -> int:
    """Main function of a process of one or several nodes: returns its exit code.

    An error of one node ends the process. The message names the node.

    Args:
        create: makes the nodes, after ROS was initialised with the command line.
        exit_codes: of errors that have their own; of any other error it is NodeExit.ERROR.
        arguments: of the nodes; None: the command line of the process.
    """
    name = sys.argv[0].rpartition("/")[2]

    async def run(node: Node, logic: Runnable) -> None:
        nonlocal name
        try:
            await logic.run()
        except RelformError:
            name = node.get_fully_qualified_name()
            raise

    try:
        # Before the logic runs, a signal ends the process immediately; later it ends the next waiting.
        for signum in (signal.SIGINT, signal.SIGTERM):
            signal.signal(signum, signal.default_int_handler)
        _initialize_ros(sys.argv[1:] if arguments is None else arguments)
        nodes = create()
        spinner = Spinner(*(node for node, _ in nodes))
        logics = []
        for node, build in nodes:
            name = node.get_fully_qualified_name()
            logics.append(run(node, build(node, spinner)))
            warn_of_unknown(node)
        gc.freeze()  # a full collection of what there is by now would take longer than a control period
        for signum in (signal.SIGINT, signal.SIGTERM):
            signal.signal(signum, spinner.interrupt)
        spinner.run(logics)
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
