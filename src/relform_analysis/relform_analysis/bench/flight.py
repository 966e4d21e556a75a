"""Benchmark: the time of every part of a control step, and of a flight without ROS."""

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from rich.console import Console
from rich.table import Table

from relform_analysis.bench.timed_solver import TimedKernelSolver
from relform_analysis.flight.log import FlightLog
from relform_analysis.flight.simulate import fly_in_process
from relform_controller.estimation.estimator import AppliedInputs, Estimator, TeamEstimate, Waiting
from relform_controller.estimation.registry import make_estimator
from relform_controller.formation_controller import FormationController
from relform_controller.ocp.problem import Ocp, Prediction
from relform_core.arrays import Array
from relform_core.load import LoadedScenario, load_scenario
from relform_core.measurements import TeamMeasurements
from relform_core.scenario_config import ScenarioConfig
from relform_core.script import CommandParser, command, positive
from relform_core.telemetry import Decision, Standby


@dataclass(frozen=True)
class Timed:
    """A flight, and the time that it took."""

    log: FlightLog
    cpu_time: float
    """CPU time of this process [s]."""
    parts: Mapping[str, Array]
    """Times of the parts of a control step, of each step after the start [s]."""

    @property
    def realtime_factor(self) -> float:
        """Real-time factor on an otherwise idle core."""
        return self.log.flown / self.cpu_time


PARTS = (
    "estimate",
    "prepare, C",
    "feedback, C",
    "Python around the C code",
    "shift and transform the plan",
    "reference, telemetry, the rest",
    "whole control step",
)


class TimedEstimator:
    """An estimator, and the time that each update took."""

    def __init__(self, estimator: Estimator) -> None:
        self._estimator = estimator
        self.times: list[float] = []
        """[s]."""

    @property
    def estimates_disturbances(self) -> bool:
        """See ``Estimator``."""
        return self._estimator.estimates_disturbances

    def update(
        self,
        measurements: TeamMeasurements,
        applied: Mapping[int, AppliedInputs],
        predicted: Prediction | None,
    ) -> TeamEstimate | Waiting:
        """See ``Estimator``."""
        begin = time.perf_counter()
        estimate = self._estimator.update(measurements, applied, predicted)
        self.times.append(time.perf_counter() - begin)
        return estimate


class TimedController(FormationController):
    """A controller that measures the parts of its control steps."""

    def __init__(self, config: ScenarioConfig) -> None:
        self._timed_estimator = TimedEstimator(make_estimator(config))
        self._timed_solvers: list[TimedKernelSolver] = []
        super().__init__(config, estimator=self._timed_estimator, solver=self._timed_solver)
        self._rows: list[tuple[float, ...]] = []

    def step(self, measurements: TeamMeasurements, sqp_steps: int | None = None) -> Decision | Standby:
        """See ``FormationController``."""
        (solver,) = self._timed_solvers
        n_estimates, n_prepared, n_solved = self._counts()
        begin = time.perf_counter()
        decision = self.feedback(measurements, sqp_steps)
        fed_back = time.perf_counter()
        n_whole = len(solver.whole_times)
        if isinstance(decision, Decision):
            self.prepare_next()
        end = time.perf_counter()
        estimate = sum(self._timed_estimator.times[n_estimates:])
        prepared, solved = sum(solver.prepare_times[n_prepared:]), sum(solver.feedback_times[n_solved:])
        whole = sum(solver.whole_times[n_prepared + n_solved :])
        after = sum(solver.whole_times[n_whole:])
        before = whole - after
        self._rows.append(
            (
                estimate,
                prepared,
                solved,
                whole - prepared - solved,
                end - fed_back - after,
                fed_back - begin - estimate - before,
                end - begin,
            )
        )
        return decision

    def parts(self) -> Mapping[str, Array]:
        """Times of the parts, of each control step after the start [s]."""
        # The first control step iterates to convergence and is no measure of the others.
        columns = np.array(self._rows[1:]).T
        return dict(zip(PARTS, columns, strict=True))

    def _counts(self) -> tuple[int, int, int]:
        (solver,) = self._timed_solvers
        return len(self._timed_estimator.times), len(solver.prepare_times), len(solver.feedback_times)

    def _timed_solver(self, ocp: Ocp) -> TimedKernelSolver:
        solver = TimedKernelSolver(ocp)
        self._timed_solvers.append(solver)
        return solver


@command
def main(arguments: Sequence[str] | None = None) -> int:
    """Measure and print; returns the exit code, 2 if the scenario cannot be flown."""
    parser = CommandParser(
        prog="bench", description="Measure the parts of a control step, and flights, without ROS."
    )
    parser.add_argument("--scenario", default="paper", help="path or plain name (default: paper)")
    parser.add_argument("--flights", type=positive, default=5, help="flights to measure (default 5)")
    parser.add_argument("--set", dest="overrides", action="append", default=[], metavar="KEY=VALUE")
    options = parser.parse_args(arguments)
    scenario = load_scenario(options.scenario, options.overrides)
    fly_in_process(scenario)  # not measured, because it may have to compile
    flights = [_timed(scenario.with_seed(seed)) for seed in range(1, 1 + options.flights)]
    Console().print(_table(scenario, flights))
    return 0


def _timed(scenario: LoadedScenario) -> Timed:
    controller = TimedController(scenario.config)
    begin = time.process_time()
    log = fly_in_process(scenario, controller)
    return Timed(log, time.process_time() - begin, controller.parts())


def _table(scenario: LoadedScenario, flights: Sequence[Timed]) -> Table:
    n_vehicles = len(scenario.config.team.vehicles)
    title = (
        f"{scenario.config.name}: {n_vehicles} vehicles, "
        f"{len(flights)} flights of {flights[0].log.flown:.0f} s"
    )
    table = Table(title=title, title_justify="left", box=None)
    for heading in ("", "median", "least", "99 %", "most"):
        table.add_column(heading, justify="left" if not heading else "right")

    def add(name: str, values: Array, digits: int) -> None:
        numbers = (np.median(values), values.min(), np.percentile(values, 99.0), values.max())
        table.add_row(name, *(f"{number:.{digits}f}" for number in numbers))

    for part in PARTS:
        add(f"{part} (ms)", 1e3 * np.concatenate([flight.parts[part] for flight in flights]), 3)
    # The first control step iterates to convergence and is no measure of the others.
    add("SQP steps per control step", np.concatenate([f.log.solver["sqp_steps"][1:] for f in flights]), 0)
    add("CPU time of a flight (s)", np.array([flight.cpu_time for flight in flights]), 2)
    add("real-time factor on one core", np.array([flight.realtime_factor for flight in flights]), 1)
    steps = [len(flight.log.solver["sqp_steps"]) / flight.cpu_time for flight in flights]
    add("control steps per second, with simulation", np.array(steps), 0)
    return table
