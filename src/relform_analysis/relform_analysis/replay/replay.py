"""Counterfactual replay: feed recorded measurements to a controller and compare its decisions.

The measurements do not react to the new decisions. So the differences are those of single decisions, not of
flights.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from relform_analysis.flight.bag_configuration import BagConfiguration
from relform_analysis.flight.log_builder import FlightLogBuilder
from relform_controller.blas import one_blas_thread
from relform_controller.flight_director import FlightDirector
from relform_controller.live_values import LiveControllerValues
from relform_controller.team_controller import make_controller
from relform_core.arrays import Array
from relform_core.live_values import Value
from relform_core.load import LoadedScenario
from relform_core.measurements import RotorCommand, TeamMeasurements
from relform_core.telemetry import Decision, RequestMade
from relform_core.units import NANOSECONDS_PER_SECOND

Formation = Mapping[str, tuple[float, float, float]]


@dataclass(frozen=True)
class RecordedStep:
    """One control step."""

    measurements: TeamMeasurements
    formation: Formation | None
    """Accepted by the controller before this step."""
    parameters: Mapping[str, Value]
    """Accepted by the controller before this step, without the formation."""
    requests: tuple[RequestMade, ...]
    """Accepted by the controller before this step, in this order."""
    sqp_steps: int
    commands: Mapping[str, RotorCommand]
    """By vehicle; empty while the controller waited for its first measurements."""
    is_taken_over: bool = False
    """Whether this is the first step of a controller that was started in flight."""


@dataclass(frozen=True)
class RecordedFlight:
    """A flight as its controller saw it."""

    configuration: BagConfiguration
    scenario: LoadedScenario
    """The configuration as recorded."""
    steps: tuple[RecordedStep, ...]
    """From step 0 to the last one that the bag holds whole."""
    gap: str | None
    """Why later steps of the bag are left out, in words; None: there are none."""


@dataclass(frozen=True, eq=False)
class Replay:
    """Decisions of a controller beside recorded ones."""

    time: Array
    """[s], shape (step,)."""
    vehicles: tuple[str, ...]
    recorded: Array
    """Rotor speeds [rad/s], shape (step, vehicle, 4); NaN: this controller waited for its first measurements.
    Steps in which both waited are left out."""
    replayed: Array
    """Likewise."""
    plans_equal: bool
    """Whether the predicted sequences are equal too, bit for bit."""

    @property
    def difference(self) -> Array:
        """Replayed minus recorded rotor speeds [rad/s], shape (step, vehicle, 4)."""
        return self.replayed - self.recorded

    @property
    def identical(self) -> bool:
        """Whether every command is equal, bit for bit, its plan included."""
        return self.plans_equal and np.array_equal(self.recorded, self.replayed)

    @property
    def first_difference(self) -> int | None:
        """The first step with another command."""
        steps = np.flatnonzero((self.recorded != self.replayed).any(axis=(1, 2)))
        return int(steps[0]) if steps.size else None


def replay(flight: RecordedFlight, scenario: LoadedScenario, log: FlightLogBuilder | None = None) -> Replay:
    """Feed what was recorded to a new controller.

    Args:
        flight: the recording. The formations and weights that were set in flight are set again, and a
            controller with the recorded configuration takes the recorded number of SQP steps.
        scenario: for the controller; its team must be that of the recording.
        log: gets every decision; None: it is not kept.
    Raises:
        FlightError: measurements that the start needs are missing for too long.
    """
    vehicles = scenario.config.team.vehicles
    time, recorded, replayed, plans_equal = [], [], [], True
    impose_steps = scenario.config.controller == flight.scenario.config.controller
    with one_blas_thread():
        controller = make_controller(scenario.config)
        values = LiveControllerValues.from_scenario(scenario, controller.check_formation)
        for step in flight.steps:
            if step.is_taken_over:
                controller = make_controller(scenario.config)
                controller.resume()
                values = LiveControllerValues.from_scenario(scenario, controller.check_formation)
            if isinstance(controller, FlightDirector):
                for request in step.requests:
                    controller.request(request)
            if step.formation is not None:
                controller.set_formation(step.formation)
            if step.parameters:
                values = values.changed(step.parameters)
                controller.set_weights(values.weights)
            decision = controller.step(step.measurements, step.sqp_steps if impose_steps else None)
            commands = decision.commands
            if log is not None and isinstance(decision, Decision):
                log.add_decision(decision)
            plans_equal &= commands.keys() == step.commands.keys() and all(
                np.array_equal(commands[vehicle].predicted_speeds, command.predicted_speeds)
                for vehicle, command in step.commands.items()
            )
            if commands or step.commands:
                time.append(step.measurements.arrival_ns / NANOSECONDS_PER_SECOND)
                recorded.append(_speeds(step.commands, vehicles))
                replayed.append(_speeds(commands, vehicles))
    return Replay(np.array(time), vehicles, np.array(recorded), np.array(replayed), plans_equal)


def _speeds(commands: Mapping[str, RotorCommand], vehicles: tuple[str, ...]) -> list[Array]:
    """By vehicle; NaN: the controller waited for its first measurements."""
    return [commands[vehicle].speeds if commands else np.full(4, np.nan) for vehicle in vehicles]
