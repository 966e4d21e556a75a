"""A whole flight in one process and without ROS, by the classes that the nodes run."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from relform_analysis.flight.log import FlightLog
from relform_analysis.flight.log_builder import FlightLogBuilder
from relform_controller.blas import one_blas_thread
from relform_controller.flight_director import FlightDirector
from relform_controller.team_controller import TeamController, make_controller
from relform_core.load import LoadedScenario
from relform_core.measurements import Odometry, TeamMeasurements
from relform_core.telemetry import Decision, PerStep, TeamStatus
from relform_sim.team import SimulatedTeam


@dataclass(frozen=True, eq=False)
class SimulatedStep:
    """One instant of a flight: the truth, what was measured, and what was decided on it."""

    ground_truth: Mapping[str, Odometry]
    """By vehicle, in team order."""
    measurements: TeamMeasurements
    faults: Mapping[str, str]
    """Why vehicles cannot fly on, by vehicle; empty if all can."""
    decision: Decision | None
    """None while the vehicles are on the ground or fly on their own sensors, and at the last instant, where
    the scenario or a fault ends the flight."""
    status: TeamStatus | None = None
    """None in a scenario without take-off and landing, and at the last instant."""


def simulate(
    scenario: LoadedScenario,
    controller: TeamController | None = None,
) -> Iterator[SimulatedStep]:
    """Fly a scenario to its end or to the first fault, one control step at a time.

    Args:
        controller: takes requests between two steps; None: that of the scenario.
    Raises:
        FlightError: measurements that the start needs are missing for too long.
    """
    config = scenario.config
    team = SimulatedTeam(config, scenario.seed)
    if controller is None:
        controller = make_controller(config)
    measurements = team.step()
    for _ in range(config.n_steps):
        if team.faults:
            break
        outcome = controller.step(measurements)
        decision = outcome if isinstance(outcome, Decision) else None
        status = controller.status if isinstance(controller, FlightDirector) else None
        yield SimulatedStep(team.ground_truth, measurements, team.faults, decision, status)
        measurements = team.step(outcome.commands)
    yield SimulatedStep(team.ground_truth, measurements, team.faults, None)


def fly_in_process(scenario: LoadedScenario, controller: TeamController | None = None) -> FlightLog:
    """Fly a scenario to its end, or to the first fault, which is then in the log.

    Args:
        controller: None: that of the scenario.
    Raises:
        FlightError: measurements that the start needs are missing for too long.
    """
    log = FlightLogBuilder(scenario)
    with one_blas_thread():
        for step in simulate(scenario, controller=controller):
            add_step(log, step)
    return log.build()


def add_step(log: FlightLogBuilder, step: SimulatedStep) -> None:
    """Log one instant of a flight."""
    for name, odometry in step.ground_truth.items():
        log.add_ground_truth(name, odometry)
    for name, fault in step.faults.items():
        log.add_fault(step.measurements.arrival_ns, name, fault)
    if step.status is not None:
        log.add_status(PerStep(step.measurements.step, step.measurements.arrival_ns, step.status))
    if step.decision is not None:
        log.add_decision(step.decision)
