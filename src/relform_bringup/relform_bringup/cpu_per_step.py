"""Benchmark: the CPU time of one control step over ROS, process by process.

CPU time is what /proc counts for a process: user and system time of all its threads. It is read in two steps
of a running flight, so that start and end of the processes do not count. Other load on the machine disturbs
it less than the real-time factor.
"""

import os
import statistics
import time
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import suppress
from dataclasses import dataclass, field
from multiprocessing import get_context
from pathlib import Path

from rich.console import Console
from rich.table import Table

from relform_analysis.flight.summary import Outcome
from relform_bringup.flight import check_installation
from relform_bringup.fly_once import fly_once
from relform_core.errors import ConfigError, FlightError
from relform_core.load import LoadedScenario, load_scenario
from relform_core.script import CommandParser, command, positive

FIRST_STEP = 60
"""Here measuring begins: the start of the team and of the caches is over."""
LEAVE_OUT = 20
"""Steps before the end that are not measured."""
TICKS_PER_SECOND = os.sysconf("SC_CLK_TCK")
FLY = "fly"
"""Name of the process that supervises the flight, and shows it."""


def cpu_time(pid: int) -> float:
    """User and system time of all threads of a process since its start [s].

    Raises:
        OSError: it has ended.
    """
    after_name = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8").rpartition(")")[2].split()
    return sum(map(int, after_name[11:13])) / TICKS_PER_SECOND


@dataclass
class Meter:
    """Reads the CPU time of the processes of a flight in its steps ``first`` and ``last``."""

    first: int
    last: int
    cpu_times: dict[int, dict[str, float]] = field(default_factory=dict)
    """By step and process [s]."""
    wall_times: dict[int, float] = field(default_factory=dict)
    """By step [s]."""

    def read(self, step: int, pids: Mapping[str, int]) -> None:
        """To be called at the end of each step."""
        if step in (self.first, self.last):
            with suppress(OSError):
                self.cpu_times[step] = {
                    name: cpu_time(pid) for name, pid in ({FLY: os.getpid()} | dict(pids)).items()
                }
                self.wall_times[step] = time.monotonic()

    def per_step_ms(self) -> dict[str, float]:
        """CPU time of one step by process [ms]."""
        begin, end = self.cpu_times[self.first], self.cpu_times[self.last]
        return {name: 1e3 * (end[name] - begin[name]) / (self.last - self.first) for name in begin}

    def realtime_factor(self, period: float) -> float:
        """Simulation time by wall time, for a period of the steps in s."""
        return (self.last - self.first) * period / (self.wall_times[self.last] - self.wall_times[self.first])


def measure(scenario: LoadedScenario, record: bool, composed: bool) -> Meter:
    """Fly once.

    Raises:
        FlightError: the flight did not reach its end.
    """
    meter = Meter(FIRST_STEP, scenario.config.n_steps - LEAVE_OUT)
    flown = fly_once(scenario, Console(quiet=True), record=record, composed=composed, on_step=meter.read)
    if flown.ending.outcome is not Outcome.COMPLETED or meter.last not in meter.cpu_times:
        raise FlightError(f"the flight ended early: {flown.ending.reason}")
    return meter


@command
def main(arguments: Sequence[str] | None = None) -> int:
    """Measure; returns the exit code."""
    options = _parser().parse_args(arguments)
    scenario = load_scenario(options.scenario, options.overrides, seed=None)
    least = FIRST_STEP + LEAVE_OUT + 1
    if scenario.config.n_steps < least:
        raise ConfigError(f"{options.scenario}: needs at least {least} steps (has {scenario.config.n_steps})")
    check_installation(options.record, options.composed)
    # Each in a process of its own, because its monitor stays visible to other nodes until the process ends.
    with ProcessPoolExecutor(1, get_context("spawn"), max_tasks_per_child=1) as pool:
        arguments_of_flight = (scenario, options.record, options.composed)
        flights = [pool.submit(measure, *arguments_of_flight) for _ in range(options.flights)]
        meters = [flight.result() for flight in flights]
    _print_table(scenario, meters)
    return 0


def _print_table(scenario: LoadedScenario, meters: Sequence[Meter]) -> None:
    """The medians of some flights."""
    config, console = scenario.config, Console()
    costs = [meter.per_step_ms() for meter in meters]
    table = Table(
        "process", "CPU per step (ms)", title=f"{config.name}: {len(config.team.vehicles)} vehicles"
    )
    for name in costs[0]:
        table.add_row(name, f"{statistics.median(cost[name] for cost in costs):.2f}")
    table.add_section()
    table.add_row("all", f"{statistics.median(sum(cost.values()) for cost in costs):.2f}")
    console.print(table)
    factor = statistics.median(meter.realtime_factor(config.controller.period) for meter in meters)
    console.print(
        f"real-time factor {factor:.1f}; medians of {len(meters)} flights, "
        f"steps {meters[0].first} to {meters[0].last}, {os.cpu_count()} processors",
        highlight=False,
    )


def _parser() -> CommandParser:
    parser = CommandParser(
        prog="bench_ros",
        description="Measure the CPU time of a control step over ROS, process by process.",
    )
    parser.add_argument("--scenario", default="paper", metavar="FILE", help="path or plain name (paper)")
    parser.add_overrides("change a key of the scenario, as in controller=team; may be repeated")
    parser.add_argument("--flights", type=positive, default=3, metavar="N", help="number of flights (3)")
    parser.add_argument("--no-record", action="store_false", dest="record", help="fly without a recorder")
    parser.add_argument("--composed", action="store_true", help="as the option of fly")
    return parser
