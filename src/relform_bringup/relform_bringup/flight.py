"""One flight: its processes, which are watched to the end, and stopped in every case."""

import fcntl
import json
import math
import os
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from typing import TYPE_CHECKING

from rich.console import Console

from relform_analysis.flight.log import FlightLog
from relform_analysis.flight.log_builder import FlightLogBuilder
from relform_analysis.flight.summary import Ending, Outcome
from relform_bags.recover import recover_bag
from relform_bringup.display import FlightDisplay
from relform_bringup.interruption import Interruption, InterruptionError
from relform_bringup.message_store import MessageStore
from relform_bringup.supervisor import Child, Supervisor, find_setpriv
from relform_core.errors import BagError, FlightError
from relform_core.exit_codes import NodeExit
from relform_core.flight_modes import TeamMode
from relform_core.installed import executable
from relform_core.load import LoadedScenario
from relform_core.names import (
    CLOCK_NODE,
    MONITOR_NODE,
    RECORDER_NODE,
    VISUALIZATION_NODE,
    vehicle_node,
)
from relform_core.roster import Roster
from relform_core.run_folder import RunFolder

if TYPE_CHECKING:
    from relform_bringup.nodes.monitor import Monitor

QUADROTOR = ("relform_sim", "quadrotor")
"""Package and executable of a node, as in the next lines."""
CONTROLLER = ("relform_controller", "controller")
CLOCK = ("relform_sim", "clock")
RECORDER = ("relform_bags", "recorder")
COMPOSED = ("relform_bringup", "composed")
VISUALIZATION = ("relform_bringup", "visualization")
COMPOSED_NAME = "the process of all nodes"
FILE_S = 300
"""Flight time in one file of a bag, whose index the recorder keeps in memory [s]."""
WATCH_S = 0.02
"""Period at which the processes are checked."""
PIPE_BYTES = 1 << 20
"""Room for the steps of several such periods."""
STANDSTILL = 2.0
"""Share of the clock's step timeout after which the process of the clock hangs."""
END_S = 10.0
"""Time in which the nodes must end after the last step."""


@dataclass(frozen=True)
class FlownFlight:
    """The result of a flight; its nodes have ended."""

    log: FlightLog
    ending: Ending


def check_installation(record: bool, composed: bool, visualize: bool = False) -> None:
    """Check that everything that a flight starts is installed; arguments as of ``Flight``.

    Raises:
        FlightError: something is not.
    """
    find_setpriv()
    apart = (QUADROTOR, CONTROLLER, CLOCK, *((RECORDER,) if record else ()))
    beside = (VISUALIZATION,) if visualize else ()
    for package, name in (*((COMPOSED,) if composed else apart), *beside):
        executable(package, name)


class Flight:
    """The nodes of one flight.

    Args:
        folder: run folder with the effective configuration in it.
        record: whether a bag is recorded.
        composed: whether all nodes share one process.
        domain_id: ROS domain of the nodes.
        interruption: signals of the user, which end the flight.
        on_step: called at the end of each step with its number and the process ids of the nodes.
        visualize: whether the node ``visualization`` runs beside the flight, which does not need it.
    """

    def __init__(
        self,
        scenario: LoadedScenario,
        folder: RunFolder,
        record: bool,
        composed: bool,
        domain_id: int,
        interruption: Interruption,
        on_step: Callable[[int, Mapping[str, int]], None] | None = None,
        visualize: bool = False,
    ) -> None:
        self._on_step = on_step
        self._scenario = scenario
        self._folder = folder
        self._domain_id = domain_id
        self._interruption = interruption
        self._observers = [RECORDER_NODE if record else MONITOR_NODE]
        """A recorder hands what it reads to this process, so that a delivery for each message is enough."""
        self._supervisor = Supervisor(folder.log)
        self._visualize = visualize
        self._beside = Supervisor(folder.log)
        """What the flight does not need."""
        self._roster = Roster.of(scenario.config, self._observers)
        self._composed = composed
        self._clock: Child | None = None
        self._recorder: Child | None = None
        self._steps: Connection | None = None
        """The messages of each step, if another process hands them over."""
        self._monitor: Monitor | None = None
        self._watched = -math.inf
        self._say: Callable[[str], None] = print
        """Shows a line above the live display."""
        real_time = scenario.config.real_time
        self._restarts_left = 0 if real_time is None else real_time.restarts_max
        self._losses: dict[Child, str] = {}
        """How controllers were lost, without which the flight goes on until the vehicles have landed."""

    def fly(self, console: Console) -> FlownFlight:
        """Start the nodes, show the flight on the console, stop the nodes."""
        with MessageStore(self._folder.path) as store:
            return self._fly(console, store)

    def _fly(self, console: Console, store: MessageStore) -> FlownFlight:
        outcome, reason = Outcome.COMPLETED, None
        try:
            with FlightDisplay(console, self._scenario.config) as display:
                self._say = display.note
                try:
                    self._start()
                    # All members, and the clock; a monitor in this process runs already.
                    nodes = f"{self._supervisor.size} nodes"
                    if self._composed:
                        nodes = f"{len(self._roster.members) + 1} nodes in one process"
                    display.message(f"starting {nodes}, ROS_DOMAIN_ID={self._domain_id}")
                    self._watch_flight(display, store)
                finally:
                    if self._steps is not None:
                        self._steps.close()  # nothing waits until a step is read from it
                    self._supervisor.stop(first=self._recorder)
                    for child in self._beside.ended():
                        display.message(child.epitaph())
                    self._beside.stop()
        except InterruptionError as error:
            if not self._is_back_on_ground():
                outcome, reason = Outcome.INTERRUPTED, str(error)
        except FlightError as error:
            outcome, reason = Outcome.FAILED, str(error)
        if self._recorder is not None and (self._recorder.exit_code() or 0) < 0:
            with suppress(BagError):  # it was killed, perhaps before it had a bag
                recover_bag(self._folder.bag)
        if (monitor := self._monitor) is None:
            return FlownFlight(FlightLogBuilder(self._scenario).build(), Ending(outcome, reason, 0.0, 0.0))
        log = monitor.log()
        if outcome is Outcome.FAILED and log.faults:
            outcome = Outcome.FAULT
        return FlownFlight(log, Ending(outcome, reason, monitor.wall_time, monitor.flown))

    def _is_back_on_ground(self) -> bool:
        """Whether the user may end the flight now: it waits for requests, and no vehicle is in the air."""
        ground, monitor = self._scenario.config.ground, self._monitor
        waits = ground is not None and ground.waits
        return waits and monitor is not None and monitor.team_mode() is TeamMode.IDLE

    def _start(self) -> None:
        os.environ["ROS_DOMAIN_ID"] = str(self._domain_id)
        os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
        record = RECORDER_NODE in self._observers
        if self._visualize:
            self._beside.start(VISUALIZATION_NODE, self._command(VISUALIZATION))
        if self._composed:
            self._clock = self._start_sender(COMPOSED_NAME, COMPOSED, log_name="composed")
            self._recorder = self._clock if record else None
            return
        for vehicle in self._roster.vehicles:
            self._start_node(vehicle_node(vehicle), QUADROTOR, "-r", f"__ns:=/{vehicle}")
        for controller in self._roster.controllers:
            self._start_node(controller.node, CONTROLLER, "-r", f"__ns:=/{controller.name}")
        self._clock = self._start_node(CLOCK_NODE, CLOCK)
        if record:
            self._recorder = self._start_sender(RECORDER_NODE, RECORDER)

    def _start_node(self, node: str, program: tuple[str, str], *arguments: str) -> Child:
        return self._supervisor.start(node, self._member_command(program, *arguments))

    def _start_sender(self, name: str, program: tuple[str, str], log_name: str | None = None) -> Child:
        """Start the process that records if a bag is asked for, and hands each step over."""
        (observer,) = self._observers
        self._steps, sender = _open_pipe()
        with sender:
            values: dict[str, int | str] = {"pipe": sender.fileno()}
            if observer == RECORDER_NODE:
                values |= {"output": str(self._folder.bag), "max_bag_duration": FILE_S}
            # With the name of the node, because the other nodes of its process have no such parameters.
            node = observer.strip("/")
            arguments = [f"{node}:{key}:={json.dumps(value)}" for key, value in values.items()]
            command = self._member_command(program, *(each for text in arguments for each in ("-p", text)))
            # If this process is killed, the kernel sends SIGINT to that one, which then closes the bag.
            return self._supervisor.start(name, command, "INT", log_name, [sender.fileno()])

    def _member_command(self, program: tuple[str, str], *arguments: str) -> list[str]:
        return [*self._command(program), "-p", f"observers:={json.dumps(self._observers)}", *arguments]

    def _command(self, program: tuple[str, str]) -> list[str]:
        # The value is YAML; JSON is YAML too, and quotes any path correctly.
        scenario = ("-p", f"scenario:={json.dumps(str(self._folder.config))}")
        return [executable(*program), "--ros-args", "--disable-external-lib-logs", *scenario]

    def _watch_flight(self, display: FlightDisplay, store: MessageStore) -> None:
        self._interruption.check()
        # Imported here, while the nodes start, because importing ROS takes as long.
        from relform_bringup.nodes.monitor import Monitor, logged_topics, monitoring

        def show(monitor: "Monitor") -> None:
            display.show(monitor)
            if self._on_step is not None:
                self._on_step(monitor.step, self._supervisor.pids)

        topics = logged_topics(self._scenario, self._observers)
        monitor = self._monitor = Monitor(self._scenario, topics, store, show)
        if self._steps is not None:
            self._follow(monitor, self._steps)
            self._await_ends()
        else:
            with monitoring(self._scenario, self._observers, topics, monitor.take, self._watch) as run:
                run()
                self._await_ends()

    def _follow(self, monitor: "Monitor", steps: Connection) -> None:
        """Take in the steps that another process hands over, until it closes the pipe."""
        limit_s = STANDSTILL * self._scenario.config.lockstep.step_timeout
        deadline = math.inf
        while True:
            self._interruption.check()
            if steps.poll():
                try:
                    messages = steps.recv()
                except (EOFError, OSError):  # OSError: it was killed while it wrote
                    return
                monitor.take(messages)
                deadline = time.monotonic() + limit_s
                continue
            self._watch()
            if self._clock is not None and time.monotonic() > deadline:  # it would name any other node
                raise FlightError(f"{self._clock.name} has finished no step for {limit_s:g} s")
            time.sleep(WATCH_S)  # and not until the next step comes, which would wake this process for each

    def _await_ends(self) -> None:
        """Wait until all processes have ended."""
        deadline = time.monotonic() + END_S
        while running := self._supervisor.running():
            self._watch()
            if time.monotonic() > deadline:
                names = ", ".join(child.name for child in running)
                raise FlightError(f"the flight is over, but still running after {END_S:g} s: {names}")
            time.sleep(WATCH_S)
        self._watched = -math.inf
        self._watch()

    def _watch(self) -> None:
        """Raise an error if the user or a lost node ends the flight."""
        self._interruption.check()
        now = time.monotonic()
        if now - self._watched < WATCH_S:
            return
        self._watched = now
        for child in self._supervisor.ended():
            is_lost = child.exit_code() != NodeExit.FLIGHT_OVER
            if is_lost and child not in self._losses and not self._goes_on_without(child):
                raise FlightError(self._loss(child))

    def _goes_on_without(self, child: Child) -> bool:
        """Whether a flight goes on that has lost a process; a controller is started again if it may be.

        A controller that has given a reason would give it again.
        """
        is_controller = child.name in [controller.node for controller in self._roster.controllers]
        flies = self._monitor is not None and self._monitor.step >= 0
        if self._scenario.config.real_time is None or not is_controller or not flies:
            return False
        loss = self._loss(child)
        if (child.exit_code() or 0) < 0 and self._restarts_left > 0:
            self._restarts_left -= 1
            self._supervisor.restart(child)
            self._say(f"{loss}: starting it again")
        else:
            self._losses[child] = loss
            self._say(f"{loss}: the vehicles land")
        return True

    def _loss(self, child: Child) -> str:
        if child is self._clock and child.exit_code() in (NodeExit.SILENT_MEMBER, NodeExit.MEMBER_FAULT):
            words = child.last_words().removeprefix(f"{CLOCK_NODE}: ")
            return "; ".join((*self._losses.values(), words))
        step = -1 if self._monitor is None else self._monitor.step
        if step < 0:
            return f"{child.epitaph()} before the first step"
        time_s = (step + 1) * self._scenario.config.controller.period
        return f"{child.epitaph()} in step {step + 1} ({time_s:.2f} s)"


def _open_pipe() -> tuple[Connection, Connection]:
    """The ends to read and to write."""
    reader, writer = Pipe(duplex=False)
    with suppress(OSError):  # the user may have no more room; whoever writes then waits more often
        fcntl.fcntl(writer.fileno(), fcntl.F_SETPIPE_SZ, PIPE_BYTES)
    return reader, writer
