"""Benchmark: the memory of every process of a long flight in real time that takes off, hovers and lands."""

import os
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

from rich.console import Console
from rich.table import Table

from relform_analysis.flight.summary import Outcome
from relform_bringup.cpu_per_step import FLY
from relform_bringup.flight import check_installation
from relform_bringup.fly_once import fly_once
from relform_core.errors import FlightError
from relform_core.load import LoadedScenario, load_scenario
from relform_core.script import CommandParser, command, positive

START_S = 300.0
"""The start of a flight, in which memory may grow [s]."""
AROUND_S = 40.0
"""Take-off and landing take this time at most [s]."""
EVERY_S = 10.0
"""Time between two readings [s]."""


def resident_mb(pid: int) -> float:
    """Memory of a process that is its own and in RAM [MB].

    Raises:
        OSError: it has ended.
    """
    for line in Path(f"/proc/{pid}/status").read_text(encoding="utf-8").splitlines():
        if line.startswith("RssAnon:"):
            return int(line.split()[1]) / 1e3
    raise OSError(f"process {pid} has ended")


@dataclass
class MemoryMeter:
    """Reads the memory of the processes of a flight again and again.

    Args:
        period: of the steps [s].
    """

    period: float
    times: list[float] = field(default_factory=list)
    """Of the readings [s]."""
    memory: list[dict[str, float]] = field(default_factory=list)
    """By process [MB]."""

    def read(self, step: int, pids: Mapping[str, int]) -> None:
        """To be called at the end of each step."""
        time = step * self.period
        if self.times and time < self.times[-1] + EVERY_S:
            return
        with suppress(OSError):
            self.memory.append(
                {name: resident_mb(pid) for name, pid in ({FLY: os.getpid()} | dict(pids)).items()}
            )
            self.times.append(time)


def measure(scenario: LoadedScenario) -> MemoryMeter:
    """Fly once.

    Raises:
        FlightError: the flight did not reach its end.
    """
    meter = MemoryMeter(scenario.config.controller.period)
    flown = fly_once(scenario, Console(), on_step=meter.read)
    if flown.ending.outcome is not Outcome.COMPLETED:
        raise FlightError(f"the flight ended early: {flown.ending.reason}")
    return meter


@command
def main(arguments: Sequence[str] | None = None) -> int:
    """Measure; returns the exit code."""
    options = _parser().parse_args(arguments)
    hover_s = 60.0 * options.minutes
    hover = f"{{kind: hover, ramp_s: 1.0}}, formation: near, steady_from_s: 5.0, duration_s: {hover_s}"
    overrides = [
        "pacing=real_time",
        f"phases=[{{name: A, title: hover, motion: {hover}}}]",
        f"ground.time_s={hover_s + AROUND_S}",
    ]
    check_installation(True, False)
    meter = measure(load_scenario("field", [*overrides, *options.overrides], seed=None))
    _print_table(meter)
    return 0


def _print_table(meter: MemoryMeter) -> None:
    begin = next((i for i, time in enumerate(meter.times) if time >= START_S), 0)
    begun, ended = meter.times[begin], meter.times[-1]
    table = Table("process", f"after {begun:.0f} s (MB)", f"after {ended:.0f} s (MB)", "growth (%)")
    for name, first in meter.memory[begin].items():
        last = meter.memory[-1][name]
        table.add_row(name, f"{first:.1f}", f"{last:.1f}", f"{100.0 * (last / first - 1.0):+.2f}")
    Console().print(table)


def _parser() -> CommandParser:
    parser = CommandParser(
        prog="bench_memory",
        description="Measure the memory of every process of a long hover in real time, recorded.",
    )
    parser.add_argument("--minutes", type=positive, default=60, metavar="N", help="length of the hover (60)")
    parser.add_overrides("change a key of the scenario; may be repeated")
    return parser
