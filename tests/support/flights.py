"""Short simulated flights, for consistent measurements."""

import dataclasses
import math
from collections.abc import Sequence
from itertools import islice
from typing import Any

import numpy as np

from relform_analysis.flight.simulate import simulate
from relform_controller.formation_controller import FormationController
from relform_core.load import LoadedScenario
from relform_core.measurements import TeamMeasurements, VehicleMeasurements
from relform_core.telemetry import Decision

AGILE = (
    "phases=["
    "{name: P, title: line, duration_s: 1.0, steady_from_s: 0.5, formation: initial, "
    "motion: {kind: straight, speed_m_s: 2.0, ramp_s: 0.8}}, "
    "{name: Q, title: turn, duration_s: 1.5, steady_from_s: 0.5, formation: wide, "
    "motion: {kind: turn, angle_deg: 90.0, turn_s: 0.5}}]"
)
"""Override: all phases and events of the paper's scenario within 2.5 s."""


def record(scenario: LoadedScenario, n_steps: int) -> tuple[list[TeamMeasurements], list[Decision]]:
    """Fly a number of control steps; return the measurements and the decisions."""
    steps = list(islice(simulate(scenario), n_steps))
    return [step.measurements for step in steps], [step.decision for step in steps if step.decision]


def replay(controller: FormationController, measured: Sequence[TeamMeasurements]) -> list[Decision]:
    """The decisions of a controller on measurements of an earlier flight, enough at every step."""
    return [decided(controller, measurements) for measurements in measured]


def decided(controller: FormationController, measurements: TeamMeasurements) -> Decision:
    """The decision of a controller on one step; the measurements must be enough for one."""
    decision = controller.step(measurements)
    assert isinstance(decision, Decision), decision.reason
    return decision


def replaced(measurements: TeamMeasurements, vehicle: str, **messages: Any) -> TeamMeasurements:
    """The same measurements with other messages of one vehicle, by sensor; None for a lost message."""
    by_vehicle = dict(measurements.by_vehicle)
    by_sensor = {**by_vehicle[vehicle].by_sensor, **{name: (message,) for name, message in messages.items()}}
    by_vehicle[vehicle] = VehicleMeasurements(
        {name: arrived for name, arrived in by_sensor.items() if arrived != (None,)}
    )
    return dataclasses.replace(measurements, by_vehicle=by_vehicle)


def all_speeds(decisions: Sequence[Decision]) -> np.ndarray:
    """Rotor speeds [rad/s], shape (step, vehicle, rotor)."""
    return np.array([[command.speeds for command in decision.commands.values()] for decision in decisions])


def seconds(scenario: LoadedScenario, time: float) -> int:
    """The control step at a time of the flight."""
    return math.ceil(time / scenario.config.controller.period - 1e-9)
