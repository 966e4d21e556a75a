"""Node of a simulated quadrotor. The name of the vehicle is the namespace of the node."""

from functools import partial
from typing import Any

import rclpy
from rclpy.node import Node

from relform_core.errors import ConfigError
from relform_core.flight_modes import ON_THE_GROUND
from relform_core.live_values import live_vehicle_values
from relform_core.load import LoadedScenario
from relform_core.measurements import Odometry, RotorCommand, VehicleMeasurements
from relform_core.names import GROUND_TRUTH, ROTOR_SPEEDS, VEHICLE_NODE, vehicle_topic
from relform_core.roster import Roster
from relform_core.telemetry import Event, FaultReported, ParametersSet, PerStep
from relform_msgs.msg import RotorSpeeds
from relform_ros.commands import check_period, rotor_command_from_msg
from relform_ros.events import event_to_msg
from relform_ros.live_parameters import LiveParameters
from relform_ros.make_pacing import make_pacing
from relform_ros.odometry import odometry_from_data, odometry_from_msg, odometry_to_msg
from relform_ros.pacing import Pacing, Stamped
from relform_ros.parameters import read_observers, read_scenario
from relform_ros.run_node import Runnable, run_node
from relform_ros.sensors.wire import wire
from relform_ros.spinner import Spinner
from relform_sim.vehicle import Vehicle


class Quadrotor:
    """Moves its vehicle from step to step, and publishes where it is and what it measures."""

    def __init__(
        self,
        node: Node,
        vehicle: str,
        scenario: LoadedScenario,
        roster: Roster,
        pacing: Pacing,
    ) -> None:
        config = scenario.config
        self._team = config.team
        self._name = vehicle
        self._period_ns = config.period_ns
        self._n_steps = config.n_steps
        self._wires = [(source, wire(source)) for source in config.sources_of(self._name)]
        self._vehicle = Vehicle(config, scenario.seed, self._name)
        self._parameters = LiveParameters(node, live_vehicle_values(scenario))
        self._pacing = pacing
        self._events = roster.commander(self._name).events
        self._command_topic = vehicle_topic(self._name, ROTOR_SPEEDS)
        self._truth_topics = {
            vehicle_topic(other, GROUND_TRUTH): other for other in roster.vehicles if other != self._name
        }
        pacing.read(self._command_topic, self._command)
        for topic, other in self._truth_topics.items():
            decode = partial(odometry_from_msg, vehicle=other)
            pacing.read(topic, decode, decode_data=partial(odometry_from_data, vehicle=other))

    async def run(self) -> None:
        """Fly the scenario.

        Raises:
            FlightError: the flight is over before its last step.
            StopRequestedError: by a signal.
        """
        async for step in self._pacing.steps():
            self._apply_parameters(step)
            await self._receive_commands(step - 1)
            truth = self._vehicle.advance(step)
            self._publish(GROUND_TRUTH, odometry_to_msg(truth, self._name), truth)
            ground_truth = await self._others_truth(step) | {self._name: truth}
            self._publish_measurements(self._vehicle.measure(step, ground_truth))
            fault = self._vehicle.fault(step, ground_truth) or ""
            if fault:
                self._publish_event(step, FaultReported(fault))
            rests = self._vehicle.mode in ON_THE_GROUND
            self._pacing.done(step, fault, report=lambda: self._vehicle.report, rests=rests)

    def _command(self, msg: RotorSpeeds) -> RotorCommand:
        """A command; raises RejectionError if it cannot be used."""
        command = rotor_command_from_msg(msg, self._name)
        check_period(command.period_ns, self._period_ns)
        return command

    def _apply_parameters(self, step: int) -> None:
        """Apply what was changed since the last step, and publish it as an event."""
        if changes := self._parameters.take():
            self._vehicle.set_limits(self._parameters.live.config)
            self._publish_event(step, ParametersSet(changes))
        if step == self._n_steps:
            self._parameters.close()

    async def _receive_commands(self, step: int) -> None:
        """Hand over the commands that have arrived in the interval that begins with a step."""
        if step < 0:
            return
        gathered = await self._pacing.gather(step, [self._command_topic])
        commands: tuple[RotorCommand, ...] = gathered.messages.get(self._command_topic, ())
        start_ns = step * self._period_ns
        arrivals_ns = gathered.arrivals_ns.get(self._command_topic, (start_ns,) * len(commands))
        for command, arrival_ns in zip(commands, sorted(arrivals_ns), strict=True):
            self._vehicle.receive(command, max(start_ns, arrival_ns))

    async def _others_truth(self, step: int) -> dict[str, Odometry]:
        messages = (await self._pacing.gather(step, self._truth_topics)).messages
        return {self._truth_topics[topic]: truth for topic, (truth,) in messages.items()}

    def _publish_measurements(self, measurements: VehicleMeasurements) -> None:
        for source, its_wire in self._wires:
            for measurement in measurements.arrived(source):
                self._publish(source.name, its_wire.to_msg(measurement, self._name), measurement)

    def _publish_event(self, step: int, content: ParametersSet | FaultReported) -> None:
        event = PerStep(step, step * self._period_ns, Event(self._name, content))
        self._pacing.publish(self._events, event_to_msg(event, self._team))

    def _publish(self, name: str, message: Any, content: Stamped) -> None:
        self._pacing.publish(vehicle_topic(self._name, name), message, content)


def _vehicle_name(node: Node, roster: Roster) -> str:
    namespace = node.get_namespace()
    if (name := namespace.strip("/")) not in roster.vehicles:
        known = ", ".join(roster.vehicles)
        raise ConfigError(
            f"unknown vehicle, namespace '{namespace}', expected one of {known}: "
            "add --ros-args -r __ns:=/<vehicle>"
        )
    return str(name)


def build_quadrotor(node: Node, spinner: Spinner) -> Runnable:
    """A quadrotor, by the parameters of the node.

    Raises:
        ConfigError: a parameter is missing or not usable, or the namespace is not a vehicle.
    """
    scenario = read_scenario(node)
    roster = Roster.of(scenario.config, read_observers(node))
    vehicle = _vehicle_name(node, roster)
    pacing = make_pacing(node, spinner, scenario, roster)
    return Quadrotor(node, vehicle, scenario, roster, pacing)


def main() -> int:
    """Run the node."""
    return run_node(lambda: rclpy.create_node(VEHICLE_NODE), build_quadrotor)
