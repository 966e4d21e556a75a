"""A whole flight in one process and without ROS, by the very classes that the nodes run."""

from threadpoolctl import threadpool_limits

from relform_analysis.flight.log import FlightLog, FlightLogBuilder
from relform_controller.formation_controller import FormationController
from relform_core.load import LoadedScenario
from relform_core.measurements import RotorCommand, TeamMeasurements
from relform_sim.vehicle import Vehicle


def fly_in_process(scenario: LoadedScenario) -> FlightLog:
    """Fly a scenario to its end, or to the first fault, which is then in the log.

    Raises:
        FlightError: the flight cannot start.
    """
    with threadpool_limits(limits=1, user_api="blas"):  # as in the leader node: else the last digits differ
        return _fly(scenario)


def _fly(scenario: LoadedScenario) -> FlightLog:
    config = scenario.config
    vehicles = {name: Vehicle(config, scenario.seed, name) for name in config.team.vehicles}
    controller = FormationController(config)
    log = FlightLogBuilder(scenario)
    commands: dict[str, RotorCommand | None] = dict.fromkeys(vehicles)
    for step in range(config.n_steps + 1):
        stamp_ns = step * config.period_ns
        ground_truth = {name: vehicle.advance(step, commands[name]) for name, vehicle in vehicles.items()}
        for name, odometry in ground_truth.items():
            log.add_ground_truth(name, odometry)
        measurements = {name: vehicle.measure(step, ground_truth) for name, vehicle in vehicles.items()}
        faults = {name: vehicle.fault(step, ground_truth) for name, vehicle in vehicles.items()}
        for name, fault in faults.items():
            if fault is not None:
                log.add_fault(stamp_ns, name, fault)
        if step == config.n_steps or any(faults.values()):
            break
        decision = controller.step(TeamMeasurements(step, stamp_ns, measurements))
        log.add_decision(decision)
        commands = dict(decision.commands)
    return log.build()
