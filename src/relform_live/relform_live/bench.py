"""Benchmark of the view: how evenly it moves, what it costs for larger teams, and whether its memory grows.

A team flies along a circle with made-up messages, in the process of the view, so that nothing but the view
and the browser is measured. Headless Chromium draws in software.
"""

import os
import statistics
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from relform_analysis.report.chromium import launched
from relform_core.errors import ConfigError
from relform_core.load import load_scenario
from relform_core.measurements import Odometry
from relform_core.names import EstimatorMode, SolverState
from relform_core.rotation import quaternion_from_yaw
from relform_core.scenario_config import ScenarioConfig
from relform_core.script import CommandParser, command, positive
from relform_core.sensors.range_bearing import RangeBearing, RangeBearings
from relform_core.telemetry import (
    EstimatorReport,
    LeaderEstimate,
    PairEstimate,
    PerStep,
    SolverReport,
    TeamReference,
    TeamState,
)
from relform_core.units import NANOSECONDS_PER_SECOND
from relform_live.scene.flight_data import FlightData
from relform_live.scene.shown_time import ShownTime
from relform_live.scene.track import turned
from relform_live.viewer.flight_page import FlightPage
from relform_live.viewer.panel import Panel
from relform_live.viewer.server import serving, url

if TYPE_CHECKING:
    import viser
    from playwright.sync_api import CDPSession, Page

PORT = 8099
WARM_UP_S = 8.0
"""Time in which the page opens and its caches fill."""
RADIUS_M, SPEED_M_S = 6.0, 2.0
WIDTH, HEIGHT = 640, 400
ARGUMENTS = ["--enable-unsafe-swiftshader", "--use-gl=angle", "--use-angle=swiftshader"]
WATCH = """() => {
    const seen = window.relformSeen = {poses: [], frames: 0};
    let before = null;
    const look = () => {
        seen.frames += 1;
        const pose = window.__viserMutable?.nodePoseData?.["/flight/truth/leader"]?.position;
        if (pose && (!before || pose.some((value, axis) => value !== before[axis]))) {
            seen.poses.push(performance.now());
            if (seen.poses.length > 100000) seen.poses.shift();
            before = [...pose];
        }
        requestAnimationFrame(look);
    };
    look();
}"""
"""Notes in each drawn frame whether the leader has another place."""


class MadeUpFlight:
    """Messages of a team that flies along a circle without errors."""

    def __init__(self, config: ScenarioConfig) -> None:
        self.data = FlightData(config)
        self._config = config
        self._places = {
            name: np.array(place) for name, place in config.formations[config.phases[0].formation].items()
        }
        team = config.team
        places = {team.leader: np.zeros(3)} | self._places
        self._formation = {
            (a, b): places[b] - places[a] for a in team.vehicles for b in team.vehicles if a != b
        }

    def step(self, step: int) -> None:
        """Take in the messages of a control step."""
        config, data = self._config, self.data
        stamp_ns = step * config.period_ns
        angle = SPEED_M_S / RADIUS_M * stamp_ns / NANOSECONDS_PER_SECOND
        center = np.array([RADIUS_M * np.cos(angle), RADIUS_M * np.sin(angle), 2.0])
        yaw, zero = angle + 0.5 * np.pi, np.zeros(3)
        leader = config.team.leader
        for name in config.team.vehicles:
            place = center + turned(yaw, self._places.get(name, zero))
            unknown = np.zeros((6, 6))
            data.take_truth(
                name, Odometry(stamp_ns, place, quaternion_from_yaw(yaw), zero, zero, unknown, unknown)
            )
            seen = {other: RangeBearing(other, 1.0, 0.0, 0.0, np.eye(3)) for other in config.targets_of[name]}
            data.take_sightings(name, RangeBearings(stamp_ns, seen))
        pairs = tuple(
            PairEstimate(leader, name, place, place, 0.0, 1e-4, False) for name, place in self._places.items()
        )
        estimator = EstimatorReport(EstimatorMode.MEASURED, "", 3.0, 3)
        state = TeamState("A", pairs, 0.0, 0.0, LeaderEstimate(center, yaw, None), estimator)
        data.take_state(PerStep(step, stamp_ns, state))
        reference = TeamReference("A", center, zero, yaw, self._formation)
        data.take_reference(PerStep(step, stamp_ns, reference))
        report = SolverReport(SolverState.SOLVED, "", 1.0, 1.0, 0.1, 1, 1, 0, (), 1e-3, 1e-4)
        data.take_solver(PerStep(step, stamp_ns, report))


class Driver(threading.Thread):
    """Plays the part of the node: messages at the control rate, pictures at the rate of the view."""

    def __init__(self, server: "viser.ViserServer", config: ScenarioConfig, rate_hz: float) -> None:
        super().__init__(daemon=True)
        self._flight = MadeUpFlight(config)
        self._page = FlightPage(server, Panel(server), self._flight.data)
        self._rate_hz = rate_hz
        self._period = config.controller.period
        self.pictures = 0
        self.cpu_s = 0.0
        """CPU time of the pictures."""
        self.ended = threading.Event()

    def run(self) -> None:
        """Fly until the end."""
        shown, start, step = ShownTime(), time.monotonic(), 0
        while not self.ended.is_set():
            now = time.monotonic()
            while step * self._period <= now - start:
                self._flight.step(step)
                shown.arrived(step * round(self._period * NANOSECONDS_PER_SECOND), now)
                step += 1
            if (stamp_ns := shown.at(now)) is not None:
                began = time.thread_time()
                self._page.draw(stamp_ns, shown.rate(now))
                self.cpu_s += time.thread_time() - began
                self.pictures += 1
            self.ended.wait(max(0.0, start + self.pictures / self._rate_hz - time.monotonic()))


@dataclass(frozen=True)
class Memory:
    """After garbage collection."""

    minutes: float
    server_mb: float
    browser_mb: float
    """JavaScript heap."""


@dataclass(frozen=True)
class Measured:
    """Of one run."""

    n_vehicles: int
    intervals_ms: list[float]
    """Between two updates of a pose in the browser."""
    frames_per_s: float
    """Drawn by the browser."""
    cpu_per_picture_ms: float
    memory: list[Memory]


def measure(n_vehicles: int, seconds: float, rate_hz: float, sample_s: float) -> Measured:
    """Show a team for some time."""
    changes = [
        f"team.followers={n_vehicles - 1}",
        "formations_m={initial: {kind: grid, spacing_m: 1.5}, wide: {kind: grid, spacing_m: 2.0}}",
    ]
    config = load_scenario("paper", changes).config
    with serving(PORT) as server, opened(url(server)) as (page, session):
        driver = Driver(server, config, rate_hz)
        driver.start()
        page.wait_for_timeout(1e3 * WARM_UP_S)
        page.evaluate(WATCH)
        cpu_s, pictures, began, memory = driver.cpu_s, driver.pictures, time.monotonic(), []
        while (elapsed := time.monotonic() - began) < seconds:
            page.wait_for_timeout(1e3 * min(sample_s, seconds - elapsed))
            memory.append(_memory(session, (time.monotonic() - began) / 60.0))
        seen = page.evaluate("() => window.relformSeen")
        driver.ended.set()
        driver.join()
    return Measured(
        n_vehicles,
        np.diff(seen["poses"]).tolist(),
        seen["frames"] / (time.monotonic() - began),
        1e3 * (driver.cpu_s - cpu_s) / (driver.pictures - pictures),
        memory,
    )


@contextmanager
def opened(address: str) -> "Iterator[tuple[Page, CDPSession]]":
    """The page in a headless browser.

    Raises:
        ConfigError: the browser is not installed.
    """
    try:
        from playwright.sync_api import Error, sync_playwright
    except ImportError:
        raise ConfigError("playwright is not installed: run make setup") from None
    with sync_playwright() as playwright:
        try:
            browser = launched(playwright, *ARGUMENTS)
        except Error as error:
            raise ConfigError(f"Chromium does not start: {error.message.splitlines()[0]}") from None
        page = browser.new_page(viewport={"width": WIDTH, "height": HEIGHT})
        page.goto(address)
        yield page, page.context.new_cdp_session(page)
        browser.close()


def _memory(session: "CDPSession", minutes: float) -> Memory:
    session.send("HeapProfiler.collectGarbage")
    session.send("Performance.enable")
    metrics: Any = {each["name"]: each["value"] for each in session.send("Performance.getMetrics")["metrics"]}
    pages = int(Path("/proc/self/statm").read_text(encoding="utf-8").split()[1])
    return Memory(minutes, pages * os.sysconf("SC_PAGE_SIZE") / 1e6, metrics["JSHeapUsedSize"] / 1e6)


@command
def main(arguments: Sequence[str] | None = None) -> int:
    """Measure; returns the exit code."""
    options = _parser().parse_args(arguments)
    heads = ("vehicles", "interval (ms): median", "p95", "p99", "drawn/s", "CPU/picture (ms)")
    print("{:>8} {:>22} {:>6} {:>6} {:>8} {:>17}".format(*heads))
    for n_vehicles in options.vehicles:
        measured = measure(n_vehicles, options.seconds, options.rate, options.sample)
        intervals = sorted(measured.intervals_ms)
        median, p95, p99 = statistics.median(intervals), *(np.percentile(intervals, (95, 99)))
        print(
            f"{n_vehicles:8} {median:22.1f} {p95:6.1f} {p99:6.1f} {measured.frames_per_s:8.1f} "
            f"{measured.cpu_per_picture_ms:17.2f}",
            flush=True,
        )
        for memory in measured.memory:
            print(
                f"    after {memory.minutes:5.1f} min: view {memory.server_mb:.1f} MB, "
                f"heap of the page {memory.browser_mb:.1f} MB"
            )
    return 0


def _parser() -> CommandParser:
    parser = CommandParser(
        prog="bench_live",
        description="Measure the view in headless Chromium: evenness, cost for larger teams, and memory.",
    )
    parser.add_argument(
        "--vehicles", type=positive, nargs="+", default=[3, 12, 16], metavar="N", help="team sizes (3 12 16)"
    )
    parser.add_argument("--seconds", type=positive, default=60, metavar="S", help="length of each run (60)")
    parser.add_argument("--rate", type=float, default=15.0, metavar="HZ", help="pictures per second (15)")
    parser.add_argument(
        "--sample", type=positive, default=30, metavar="S", help="time between two looks at the memory (30)"
    )
    return parser
