"""Benchmark: memory of every process, time of a step and size of the bag in a long flight.

It takes off, hovers in real time or flies a random mission in lock-step, and lands.
"""

import os
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from rich.console import Console
from rich.table import Table

from relform_analysis.flight.summary import Outcome
from relform_bringup.cpu_per_step import FLY
from relform_bringup.flight import check_installation
from relform_bringup.fly_once import fly_once
from relform_bringup.long_mission import random_mission
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


@dataclass(frozen=True)
class Reading:
    """What was read at one time of a flight."""

    time: float
    """Time of the flight [s]."""
    clock: float
    """Monotonic time [s]."""
    memory_mb: Mapping[str, float]
    """By process."""
    bag_mb: float
    """Size of the bag."""


@dataclass
class Meter:
    """Reads the processes and the bag of a flight again and again.

    Args:
        period: of the steps [s].
        clock: monotonic time [s].
    """

    period: float
    clock: Callable[[], float]
    readings: list[Reading] = field(default_factory=list)
    bag: Path = field(default=Path(), init=False)

    def note_bag(self, bag: Path) -> None:
        """To be called before the flight."""
        self.bag = bag

    def read(self, step: int, pids: Mapping[str, int]) -> None:
        """To be called at the end of each step."""
        now = step * self.period
        if self.readings and now < self.readings[-1].time + EVERY_S:
            return
        with suppress(OSError):
            memory_mb = {name: resident_mb(pid) for name, pid in ({FLY: os.getpid()} | dict(pids)).items()}
            bag_mb = sum(file.stat().st_size for file in self.bag.glob("*.mcap")) / 1e6
            self.readings.append(Reading(now, self.clock(), memory_mb, bag_mb))


def measure(scenario: LoadedScenario, composed: bool) -> list[Reading]:
    """Fly once.

    Raises:
        FlightError: the flight did not reach its end.
    """
    meter = Meter(scenario.config.controller.period, time.monotonic)
    flown = fly_once(scenario, Console(), composed=composed, on_step=meter.read, note_bag=meter.note_bag)
    if flown.ending.outcome is not Outcome.COMPLETED:
        raise FlightError(f"the flight ended early: {flown.ending.reason}")
    return meter.readings


@command
def main(arguments: Sequence[str] | None = None) -> int:
    """Measure; returns the exit code."""
    options = _parser().parse_args(arguments)
    length = 60.0 * options.minutes
    hover = f"{{kind: hover, ramp_s: 1.0}}, formation: near, steady_from_s: 5.0, duration_s: {length}"
    mission = ["pacing=real_time", f"phases=[{{name: A, title: hover, motion: {hover}}}]"]
    if options.random_mission is not None:
        mission = random_mission(options.random_mission, length)
    overrides = [*mission, f"ground.time_s={length + AROUND_S}", *options.overrides]
    check_installation(True, False)
    _print(measure(load_scenario("field", overrides, seed=options.random_mission), options.composed))
    return 0


def _print(readings: Sequence[Reading]) -> None:
    """Compare the end of a flight with the end of its start."""
    first, last = readings[0], readings[-1]
    begun = next(reading for reading in readings if reading.time >= min(START_S, last.time / 2))
    half = next(reading for reading in readings if reading.time >= (begun.time + last.time) / 2)
    table = Table("", *(f"after {reading.time:.0f} s" for reading in (begun, last)), "growth (%)")
    for name in begun.memory_mb:
        _add(table, f"memory of {name} (MB)", begun.memory_mb[name], last.memory_mb[name])
    _add(table, "bag (kB per s of flight)", *(_rate(first, until, "bag_mb", 1e3) for until in (begun, last)))
    paces = _rate(begun, half, "clock", 1e3), _rate(half, last, "clock", 1e3)
    _add(table, "wall time per s of flight, first half and second (ms)", *paces)
    Console().print(table)


def _rate(since: Reading, until: Reading, name: Literal["bag_mb", "clock"], scale: float) -> float:
    """Change of a quantity per second of flight."""
    change: float = getattr(until, name) - getattr(since, name)
    return scale * change / max(until.time - since.time, EVERY_S)


def _add(table: Table, name: str, begun: float, ended: float) -> None:
    table.add_row(name, f"{begun:.1f}", f"{ended:.1f}", f"{100.0 * (ended / begun - 1.0):+.2f}")


def _parser() -> CommandParser:
    parser = CommandParser(
        prog="bench_memory",
        description="Measure memory, time of a step and size of the bag in a long flight, recorded.",
    )
    parser.add_argument("--minutes", type=positive, default=60, metavar="N", help="length of the flight (60)")
    parser.add_argument(
        "--random-mission",
        type=int,
        metavar="SEED",
        help="fly random motions, formations and disturbances in lock-step, not a hover in real time",
    )
    parser.add_argument("--composed", action="store_true", help="as the option of fly")
    parser.add_overrides("change a key of the scenario; may be repeated")
    return parser
