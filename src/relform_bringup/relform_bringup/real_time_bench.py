"""Benchmark: flights on the wall clock at several control rates, idle and with a busy core.

Latency is the time from the instant of the measurements to the arrival of the command at the vehicle, by the
nodes' own count. A busy core runs an endless loop at the usual priority.
"""

import os
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import product
from multiprocessing import get_context

from rich.console import Console

from relform_analysis.flight.real_time import RealTimeMetrics, real_time_metrics
from relform_analysis.flight.summary import Ending, Outcome
from relform_analysis.sweep.plan import load_variants
from relform_bringup.flight import check_installation
from relform_bringup.fly_once import fly_once
from relform_core.errors import ConfigError
from relform_core.load import LoadedScenario, load_scenario
from relform_core.script import CommandParser, command, positive, print_error

ENDLESS = "import os\nos.sched_setaffinity(0, {max(os.sched_getaffinity(0))})\nwhile True: pass"
"""A program that keeps one core busy."""
HEADINGS = (
    "rate (Hz)",
    "processes",
    "load",
    "command on board: median / 99 % / most (ms)",
    "decision: median / 99 % / most (ms)",
    "steps missed: controller, vehicles",
    "of",
)


@dataclass(frozen=True)
class Case:
    """One flight of the benchmark."""

    rate: int
    """Control rate [Hz]."""
    composed: bool
    busy: bool
    """Whether one core is kept busy."""


def scenario_at(rate: int, scenario: str, duration: float, overrides: Sequence[str]) -> LoadedScenario:
    """A scenario in real time at a control rate of ``config/sweeps/rates.yaml``.

    Args:
        rate: [Hz].
        duration: of its last phase, which is changed for it [s].
    Raises:
        ConfigError: there is no such rate.
    """
    rates = {variant.name: variant.set for variant in load_variants("rates")}
    if (name := f"hz{rate}") not in rates:
        known = ", ".join(each.removeprefix("hz") for each in rates if each.removeprefix("hz").isdigit())
        raise ConfigError(f"unknown rate {rate} Hz, expected one of {known}")
    last = len(load_scenario(scenario).config.phases) - 1
    lasts = f"phases.{last}.duration_s={duration:g}"
    return load_scenario(scenario, [*rates[name], "pacing=real_time", lasts, *overrides])


def measure(scenario: LoadedScenario, case: Case) -> tuple[RealTimeMetrics | None, Ending]:
    """Fly once, recorded; returns what its nodes reported, and how it ended."""
    with _busy_core(case.busy):
        flown = fly_once(scenario, Console(quiet=True), composed=case.composed)
    return real_time_metrics(flown.log), flown.ending


@contextmanager
def _busy_core(busy: bool) -> Iterator[None]:
    if not busy:
        yield
        return
    with subprocess.Popen([sys.executable, "-c", ENDLESS]) as program:
        try:
            yield
        finally:
            program.kill()


@command
def main(arguments: Sequence[str] | None = None) -> int:
    """Measure; returns the exit code."""
    options = _parser().parse_args(arguments)
    compositions = {"both": (False, True), "apart": (False,), "composed": (True,)}[options.processes]
    for composed in compositions:
        check_installation(True, composed)
    cases = [Case(*each) for each in product(options.rates, compositions, (False, True))]
    scenarios = {
        rate: scenario_at(rate, options.scenario, options.seconds, options.overrides)
        for rate in options.rates
    }
    print(f"{os.cpu_count()} processors, {options.seconds} s, scenario {options.scenario}\n")
    print(f"| {' | '.join(HEADINGS)} |\n|{'---|' * len(HEADINGS)}")
    # Each in a process of its own, because its monitor stays visible to other nodes until the process ends.
    with ProcessPoolExecutor(1, get_context("spawn"), max_tasks_per_child=1) as pool:
        for case in cases:
            scenario = scenarios[case.rate]
            metrics, ending = pool.submit(measure, scenario, case).result()
            print(f"| {' | '.join(_row(case, scenario, metrics))} |", flush=True)
            if ending.outcome is not Outcome.COMPLETED:
                print_error(f"this flight ended after {ending.flown:.2f} s: {ending.reason}")
    return 0


def _row(case: Case, scenario: LoadedScenario, metrics: RealTimeMetrics | None) -> Iterator[str]:
    yield str(case.rate)
    yield "one for all nodes" if case.composed else "one per node"
    yield "one core busy" if case.busy else "idle"
    for ages in (None, None) if metrics is None else (metrics.commands, metrics.measurements):
        values = (float("nan"),) * 3 if ages is None else (ages.median, ages.percentile_99, ages.most)
        yield " / ".join(f"{value:.1f}" for value in values)
    yield _missed({} if metrics is None else metrics.missed_steps)
    yield str(scenario.config.n_steps + 1)


def _missed(by_node: Mapping[str, int]) -> str:
    """Of the controllers, and the most of a vehicle."""
    controllers = sum(number for node, number in by_node.items() if node.endswith("/controller"))
    vehicles = max((number for node, number in by_node.items() if node.endswith("/quadrotor")), default=0)
    return f"{controllers}, {vehicles}"


def _parser() -> CommandParser:
    parser = CommandParser(
        prog="bench_real_time",
        description="Measure latency and missed steps of recorded flights on the wall clock.",
    )
    parser.add_argument("--scenario", default="circle", metavar="FILE", help="path or plain name (circle)")
    parser.add_overrides("change a key of the scenario, as in plant.step_s=0.001; may be repeated")
    parser.add_argument(
        "--rates",
        type=positive,
        nargs="+",
        default=[20, 50, 100],
        metavar="HZ",
        help="control rates (20 50 100)",
    )
    parser.add_argument(
        "--seconds", type=positive, default=60, metavar="S", help="length of the scenario's last phase (60)"
    )
    parser.add_argument(
        "--processes", choices=("both", "apart", "composed"), default="both", help="as of fly (both)"
    )
    return parser
