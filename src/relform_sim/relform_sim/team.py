"""The simulated vehicles of a team, all in one process."""

from collections.abc import Mapping

from relform_core.measurements import Odometry, RotorCommand, TeamMeasurements
from relform_core.scenario_config import ScenarioConfig
from relform_sim.vehicle import Vehicle

NO_COMMANDS: Mapping[str, RotorCommand] = {}


class SimulatedTeam:
    """The vehicles of a scenario with their sensors and links: commands in, measurements out.

    Args:
        config: the scenario.
        seed: of every random draw, >= 0.
    Raises:
        FlightError: no start is found, see ``start_poses``.
    """

    def __init__(self, config: ScenarioConfig, seed: int = 0) -> None:
        self._period_ns = config.period_ns
        self._vehicles = {name: Vehicle(config, seed, name) for name in config.team.vehicles}
        self._next_step = 0
        self.ground_truth: Mapping[str, Odometry] = {}
        """True states at the last step, by vehicle in team order; empty before the first."""
        self.faults: Mapping[str, str] = {}
        """Why vehicles cannot fly on after the last step, by vehicle; empty if all can."""

    def step(self, commands: Mapping[str, RotorCommand] = NO_COMMANDS) -> TeamMeasurements:
        """Fly one control period and measure; the first call measures at the start of the flight.

        Args:
            commands: of the controller on the measurements of the last step, by vehicle. A vehicle without
                one flies the rest of its last plan, and hovers before its first.
        Returns:
            What arrives at the controller at the instant of this step.
        """
        step, vehicles = self._next_step, self._vehicles
        self._next_step += 1
        truth = {name: vehicle.advance(step, commands.get(name)) for name, vehicle in vehicles.items()}
        by_vehicle = {name: vehicle.measure(step, truth) for name, vehicle in vehicles.items()}
        found = {name: vehicle.fault(step, truth) for name, vehicle in vehicles.items()}
        self.faults = {name: fault for name, fault in found.items() if fault is not None}
        self.ground_truth = truth
        return TeamMeasurements(step, step * self._period_ns, by_vehicle)
