"""The phases of a flight as far as it was flown, for drawing."""

from dataclasses import dataclass

import numpy as np

from relform_analysis.flight.log import FlightLog
from relform_analysis.flight.metrics import phase_steps, steady_steps
from relform_core.arrays import Array
from relform_core.units import NANOSECONDS_PER_SECOND


@dataclass(frozen=True)
class FlownPhase:
    """Where a phase lies in the flight [s]."""

    name: str
    title: str
    start: float
    steady: float
    """Begin of its steady window; equals ``end`` if the flight did not get there."""
    end: float

    @property
    def middle(self) -> float:
        """Half-way [s]."""
        return (self.start + self.end) / 2.0

    def tick_in_the_middle(self, log: FlightLog) -> int:
        """The last instant of ground truth until half-way; it may be the last one of all."""
        return int(np.searchsorted(log.tick_ns, self.middle * NANOSECONDS_PER_SECOND, side="right")) - 1


def flown_phases(log: FlightLog) -> list[FlownPhase]:
    """The phases that were begun, in order."""
    time, steady, period = step_times(log), steady_steps(log), log.scenario.config.controller.period
    flown = []
    for phase in log.scenario.config.phases:
        steps = phase_steps(log, phase)
        if steps.any():
            end = float(time[steps][-1]) + period
            begin_steady = next(iter(time[steps & steady].tolist()), end)
            flown.append(FlownPhase(phase.name, phase.title, float(time[steps][0]), begin_steady, end))
    return flown


def step_times(log: FlightLog) -> Array:
    """Instants of the control steps [s], shape (K,)."""
    return log.step_ns / NANOSECONDS_PER_SECOND
