"""Benchmark: the time of an estimate and of an SQP step, and the real-time factor of a flight without ROS."""

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from rich.console import Console
from rich.table import Table

from relform_analysis.flight.log import FlightLog
from relform_analysis.flight.simulate import fly_in_process
from relform_controller.estimation.estimator import AppliedInputs, Estimator, TeamEstimate, Waiting
from relform_controller.estimation.registry import make_estimator
from relform_controller.formation_controller import FormationController
from relform_controller.ocp.problem import Prediction
from relform_core.arrays import Array
from relform_core.load import LoadedScenario, load_scenario
from relform_core.measurements import TeamMeasurements
from relform_core.script import CommandParser, command, positive


@dataclass(frozen=True)
class Timed:
    """A flight, and the time that it took."""

    log: FlightLog
    cpu_time: float
    """CPU time of this process [s]."""
    estimate_times: Array
    """Of each control step after the start [s]."""

    @property
    def realtime_factor(self) -> float:
        """Real-time factor on an otherwise idle core."""
        return self.log.flown / self.cpu_time


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


@command
def main(arguments: Sequence[str] | None = None) -> int:
    """Measure and print; returns the exit code, 2 if the scenario cannot be flown."""
    parser = CommandParser(prog="bench", description="Measure estimator, solver and flight, without ROS.")
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
    estimator = TimedEstimator(make_estimator(scenario.config))
    controller = FormationController(scenario.config, estimator=estimator)
    begin = time.process_time()
    log = fly_in_process(scenario, controller)
    return Timed(log, time.process_time() - begin, np.array(estimator.times[1:]))


def _table(scenario: LoadedScenario, flights: Sequence[Timed]) -> Table:
    n_vehicles = len(scenario.config.team.vehicles)
    title = (
        f"{scenario.config.name}: {n_vehicles} vehicles, "
        f"{len(flights)} flights of {flights[0].log.flown:.0f} s"
    )
    table = Table(title=title, title_justify="left", box=None)
    for heading in ("", "median", "least", "most"):
        table.add_column(heading, justify="left" if not heading else "right")

    def add(name: str, values: Array, digits: int) -> None:
        numbers = (np.median(values), values.min(), values.max())
        table.add_row(name, *(f"{number:.{digits}f}" for number in numbers))

    def solver(name: str) -> Array:
        # The first control step iterates to convergence and is no measure of the others.
        return np.concatenate([flight.log.solver[name][1:] for flight in flights])

    add("estimate (ms)", 1e3 * np.concatenate([flight.estimate_times for flight in flights]), 2)
    prepare, feedback, steps = (solver(name) for name in ("prepare_time", "feedback_time", "sqp_steps"))
    add("prepare, per control step (ms)", 1e3 * prepare, 2)
    add("feedback, per control step (ms)", 1e3 * feedback, 2)
    add("both, per SQP step (ms)", 1e3 * (prepare + feedback) / steps, 2)
    add("SQP steps per control step", steps, 0)
    add("CPU time of a flight (s)", np.array([flight.cpu_time for flight in flights]), 2)
    add("real-time factor on one core", np.array([flight.realtime_factor for flight in flights]), 1)
    return table
