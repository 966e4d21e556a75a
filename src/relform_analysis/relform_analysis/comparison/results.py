"""Numbers of flights over what they have in common, with difference and ratio to the first flight."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from relform_analysis.comparison.common import Common, CommonPart
from relform_analysis.comparison.quantities import (
    follower_yaws,
    largest_tilt,
    leader_estimate,
    leader_position_error,
    leader_yaw_error,
    least_separation,
    pair_errors,
    pair_position_estimates,
    pair_yaw_estimates,
    rotor_rpm,
    step_ms,
)
from relform_analysis.flight.metrics import steady_steps
from relform_core.arrays import Array
from relform_core.names import SolverState

NONE = "-"


@dataclass(frozen=True)
class Result:
    """One number of every flight."""

    label: str
    unit: str
    digits: int
    values: tuple[float | None, ...]
    """By flight; None: there is none."""

    def difference(self, flight: int) -> float | None:
        """Number of a flight minus that of the first one."""
        first, value = self.values[0], self.values[flight]
        return None if first is None or value is None else value - first

    def ratio(self, flight: int) -> float | None:
        """Number of a flight by that of the first one; None: it has none, or one of them is shown as 0."""
        first, value = self.values[0], self.values[flight]
        least = 0.5 * 10.0**-self.digits
        return None if first is None or value is None or min(first, value) < least else value / first

    def text(self, flight: int) -> str:
        """The number as text."""
        value = self.values[flight]
        return NONE if value is None else f"{value:.{self.digits}f}"

    def difference_text(self, flight: int) -> str:
        """The difference as text, with its sign."""
        difference = self.difference(flight)
        return NONE if difference is None else f"{round(difference, self.digits) + 0.0:+.{self.digits}f}"

    def ratio_text(self, flight: int) -> str:
        """The ratio as text."""
        ratio = self.ratio(flight)
        return NONE if ratio is None else f"{ratio:.2f}"


@dataclass(frozen=True)
class Number:
    """A number of a flight: a statistic of a quantity over the common time."""

    label: str
    unit: str
    digits: int
    values: Callable[[CommonPart], Array]
    """At every control step in the unit, shape (K, ...)."""
    statistic: Callable[[Array], float]
    """Of the values that were recorded."""
    steady: bool = False
    """Over the steady windows alone."""

    def of(self, part: CommonPart, phase: str | None = None) -> float | None:
        """The number of a flight, or of one of its phases; None: nothing was recorded there."""
        steps = part.steps & steady_steps(part.log) if self.steady else part.steps
        if phase is not None:
            steps = steps & np.array([name == phase for name in part.log.phase], dtype=np.bool_)
        values = self.values(part)[steps]
        recorded = values[np.isfinite(values)]
        return float(self.statistic(recorded)) if recorded.size else None


def _p95(values: Array) -> float:
    return float(np.percentile(values, 95.0))


def _fallbacks(status: Array) -> float:
    return float((status == SolverState.FALLBACK).sum())


def _solver(name: str) -> Callable[[CommonPart], Array]:
    return lambda part: part.log.solver[name]


NUMBERS = (
    Number("formation error, steady, mean", "m", 3, pair_errors, np.mean, steady=True),
    Number("formation error, steady, 95 %", "m", 3, pair_errors, _p95, steady=True),
    Number("formation error, steady, maximum", "m", 3, pair_errors, np.max, steady=True),
    Number("formation error, mean of all", "m", 3, pair_errors, np.mean),
    Number("formation error, maximum of all", "m", 3, pair_errors, np.max),
    Number("leader position error, steady, mean", "m", 3, leader_position_error, np.mean, steady=True),
    Number("leader position error, maximum of all", "m", 3, leader_position_error, np.max),
    Number("leader yaw error, steady, mean", "deg", 1, leader_yaw_error, np.mean, steady=True),
    Number("leader yaw error, maximum of all", "deg", 1, leader_yaw_error, np.max),
    Number("follower yaw error, steady, mean", "deg", 1, follower_yaws, np.mean, steady=True),
    Number("follower yaw error, maximum of all", "deg", 1, follower_yaws, np.max),
    Number("smallest separation", "m", 2, least_separation, np.min),
    Number("tilt, maximum", "deg", 0, largest_tilt, np.max),
    Number("rotor speed, maximum", "rpm", 0, rotor_rpm, np.max),
    Number("rotor speed, standard deviation", "rpm", 0, rotor_rpm, np.std),
    Number(
        "estimated relative position, error, steady, mean", "mm", 1, pair_position_estimates, np.mean, True
    ),
    Number("estimated relative yaw, error, steady, mean", "deg", 2, pair_yaw_estimates, np.mean, True),
    Number("estimated leader position, error, steady, mean", "mm", 1, leader_estimate, np.mean, True),
    Number("SQP steps per control step, median", "", 0, _solver("sqp_steps"), np.median),
    Number("KKT value, first SQP step, median", "", 2, _solver("kkt_first"), np.median),
    Number("KKT value, last SQP step, median", "", 3, _solver("kkt"), np.median),
    Number("solver time per control step, median", "ms", 2, step_ms, np.median),
    Number("solver time per control step, maximum", "ms", 2, step_ms, np.max),
    Number("control steps that fell back", "", 0, _solver("status"), _fallbacks),
)
"""In the order of the tables."""
BY_PHASE = (
    Number("formation error, mean", "m", 3, pair_errors, np.mean),
    Number("formation error, maximum", "m", 3, pair_errors, np.max),
    Number("leader position error, mean", "m", 3, leader_position_error, np.mean),
    Number("leader yaw error, mean", "deg", 1, leader_yaw_error, np.mean),
    Number("follower yaw error, mean", "deg", 1, follower_yaws, np.mean),
)


def results(common: Common) -> list[Result]:
    """The numbers that at least one flight has."""
    return _known(_result(number, common) for number in NUMBERS)


def phase_results(common: Common, phase: str) -> list[Result]:
    """The numbers of one of the common phases."""
    return _known(_result(number, common, phase) for number in BY_PHASE)


def _result(number: Number, common: Common, phase: str | None = None) -> Result:
    values = tuple(number.of(part, phase) for part in common.parts)
    return Result(number.label, number.unit, number.digits, values)


def _known(rows: Iterable[Result]) -> list[Result]:
    return [row for row in rows if any(value is not None for value in row.values)]
