"""Bring up a flight: one process per node, watched to the end, and stopped whatever happens."""

import json
import math
import os
import signal
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from types import FrameType
from typing import TYPE_CHECKING

from rich.console import Console

from relform_analysis.flight.log import FlightLog, FlightLogBuilder
from relform_analysis.flight.summary import Ending, Outcome
from relform_bags.recover import recover_bag
from relform_bringup.display import FlightDisplay
from relform_bringup.supervisor import Child, Supervisor
from relform_core.errors import BagError, FlightError
from relform_core.installed import executable
from relform_core.load import LoadedScenario
from relform_core.names import CLOCK_NODE, MONITOR_NODE, RECORDER_NODE, vehicle_node
from relform_core.ros_domain import claimed_domain
from relform_core.roster import Roster
from relform_core.run_folder import RunFolder

if TYPE_CHECKING:
    from relform_bringup.nodes.monitor import Monitor

WATCH_S = 0.02
"""How often the processes are looked after."""
CLOCK_VERDICTS = (2, 3)
"""Exit codes with which the clock names the node that is to blame."""
END_S = 10.0
"""How long the nodes may take to end by themselves when the flight is over."""


class InterruptionError(Exception):
    """The user ends the flight."""


class Interruption:
    """Takes note of a signal; what is under way decides when to give in."""

    def __init__(self) -> None:
        self.signal: signal.Signals | None = None

    def note(self, signum: int, frame: FrameType | None) -> None:
        """Handle a signal."""
        self.signal = self.signal or signal.Signals(signum)


@contextmanager
def interruption_noted() -> Iterator[Interruption]:
    """Within the block, SIGINT, SIGTERM and SIGHUP do nothing but to be noted."""
    interruption = Interruption()
    signums = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    before = [signal.signal(signum, interruption.note) for signum in signums]
    try:
        yield interruption
    finally:
        for signum, handler in zip(signums, before, strict=True):
            signal.signal(signum, handler)


@dataclass(frozen=True)
class FlownFlight:
    """What there is of a flight when its nodes are gone."""

    log: FlightLog
    ending: Ending


class Flight:
    """The nodes of one flight.

    Args:
        folder: of the run, with the effective configuration in it.
        record: whether a bag is recorded.
        interruption: by which the user may end the flight.
    """

    def __init__(
        self, scenario: LoadedScenario, folder: RunFolder, record: bool, interruption: Interruption
    ) -> None:
        self._scenario = scenario
        self._folder = folder
        self._interruption = interruption
        self._observers = [RECORDER_NODE, MONITOR_NODE] if record else [MONITOR_NODE]
        self._supervisor = Supervisor(folder.log)
        self._recorder: Child | None = None
        self._monitor: Monitor | None = None
        self._watched = -math.inf

    def fly(self, console: Console) -> FlownFlight:
        """Start the nodes, show the flight on the console, stop the nodes."""
        outcome, reason = Outcome.COMPLETED, None
        try:
            with claimed_domain() as domain_id, FlightDisplay(console, self._scenario.config) as display:
                try:
                    self._start(domain_id)
                    display.message(f"starting {self._supervisor.size} nodes, ROS_DOMAIN_ID={domain_id}")
                    self._watch_flight(display)
                finally:
                    self._supervisor.stop(first=self._recorder)
        except InterruptionError as error:
            outcome, reason = Outcome.INTERRUPTED, str(error)
        except FlightError as error:
            outcome, reason = Outcome.FAILED, str(error)
        if self._recorder is not None and (self._recorder.exit_code() or 0) < 0:
            with suppress(BagError):  # killed: its bag is completed, if there is one
                recover_bag(self._folder.bag)
        if (monitor := self._monitor) is None:
            return FlownFlight(FlightLogBuilder(self._scenario).build(), Ending(outcome, reason, 0.0, 0.0))
        log = monitor.log()
        if outcome is Outcome.FAILED and log.faults:
            outcome = Outcome.FAULT
        return FlownFlight(log, Ending(outcome, reason, monitor.wall_time, monitor.flown))

    def _start(self, domain_id: int) -> None:
        os.environ.update(
            ROS_DOMAIN_ID=str(domain_id),
            ROS_AUTOMATIC_DISCOVERY_RANGE="LOCALHOST",
        )
        roster = Roster.of(self._scenario.config, self._observers)
        for vehicle in roster.vehicles:
            namespace = f"__ns:=/{vehicle}"
            self._start_node(vehicle_node(vehicle), "relform_sim", "quadrotor", "-r", namespace)
        for controller in roster.controllers:
            namespace = f"__ns:=/{controller.name}"
            self._start_node(controller.node, "relform_controller", "controller", "-r", namespace)
        self._start_node(CLOCK_NODE, "relform_sim", "clock")
        if RECORDER_NODE in self._observers:
            output = f"output:={json.dumps(str(self._folder.bag))}"
            # If this process is killed, the kernel ends the recorder too, but lets it close the bag.
            self._recorder = self._start_node(
                RECORDER_NODE, "relform_bags", "recorder", "-p", output, dies_by="INT"
            )

    def _start_node(
        self, node: str, package: str, name: str, *arguments: str, dies_by: str = "KILL"
    ) -> Child:
        command = [executable(package, name), "--ros-args", "--disable-external-lib-logs"]
        # The values are YAML, of which JSON is a part: so any path is quoted as it must be.
        for parameter, value in (("scenario", str(self._folder.config)), ("observers", self._observers)):
            command += ["-p", f"{parameter}:={json.dumps(value)}"]
        return self._supervisor.start(node, [*command, *arguments], dies_by)

    def _watch_flight(self, display: FlightDisplay) -> None:
        # Imported only now, because importing ROS takes as long as the nodes take to start.
        from relform_bringup.nodes.monitor import monitoring

        with monitoring(self._scenario, self._observers, display.show, self._watch) as monitor:
            self._monitor = monitor
            monitor.run()
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
        if self._interruption.signal is not None:
            raise InterruptionError(f"interrupted by {self._interruption.signal.name}")
        now = time.monotonic()
        if now - self._watched < WATCH_S:
            return
        self._watched = now
        for child in self._supervisor.ended():
            if child.exit_code() != 0:  # with 0 it has seen the end of the flight
                raise FlightError(self._loss(child))

    def _loss(self, child: Child) -> str:
        if child.name == CLOCK_NODE and child.exit_code() in CLOCK_VERDICTS:
            return child.last_words().removeprefix(f"{CLOCK_NODE}: ")
        step = -1 if self._monitor is None else self._monitor.step
        if step < 0:
            return f"{child.epitaph()} before the first step"
        time_s = (step + 1) * self._scenario.config.controller.period
        return f"{child.epitaph()} in step {step + 1} ({time_s:.2f} s)"
