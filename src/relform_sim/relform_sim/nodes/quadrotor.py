"""A simulated quadrotor: ``Vehicle`` on the wire. The vehicle's name is the namespace of the node."""

from collections.abc import Callable
from typing import Any

import rclpy
from nav_msgs.msg import Odometry as OdometryMsg
from rclpy.node import Node

from relform_core.errors import ConfigError
from relform_core.measurements import Odometry, RotorCommand, VehicleMeasurements
from relform_core.names import EVENTS, GROUND_TRUTH, ROTOR_SPEEDS, VEHICLE_NODE, vehicle_topic
from relform_core.scenario_config import TeamConfig
from relform_core.telemetry import Event, FaultReported, ParametersSet, PerStep
from relform_core.tuning import vehicle_tuning
from relform_msgs.msg import RotorSpeeds as RotorSpeedsMsg
from relform_ros.commands import rotor_command_from_msg
from relform_ros.events import event_to_msg
from relform_ros.live_parameters import LiveParameters
from relform_ros.lockstep import StepInbox
from relform_ros.member import LockstepMember
from relform_ros.odometry import odometry_from_msg, odometry_to_msg
from relform_ros.parameters import read_observers, read_scenario
from relform_ros.run_node import Spinner, run_node
from relform_ros.sensors.wire import wire
from relform_sim.vehicle import Vehicle


class Quadrotor:
    """Moves its vehicle from tick to tick, and tells the others where it is and what it measures."""

    def __init__(self, node: Node, spinner: Spinner) -> None:
        scenario = read_scenario(node)
        config = scenario.config
        self._team = config.team
        self._name = _vehicle_name(node, config.team)
        self._period_ns = config.period_ns
        self._n_steps = config.n_steps
        self._sensors = config.sensors_of(self._name)
        self._vehicle = Vehicle(config, scenario.seed, self._name)
        self._parameters = LiveParameters(node, vehicle_tuning(scenario))
        self._truth_topics = {name: vehicle_topic(name, GROUND_TRUTH) for name in config.team.vehicles}
        self._command_topic = vehicle_topic(self._name, ROTOR_SPEEDS)
        self._others = [name for name in config.team.vehicles if name != self._name]
        self._truths = StepInbox[Odometry](
            (self._truth_topics[name] for name in self._others), self._period_ns
        )
        self._commands = StepInbox[RotorCommand]([self._command_topic], self._period_ns)
        self._member = LockstepMember(node, spinner, scenario, read_observers(node))
        self._member.report = lambda: vars(self._vehicle.counts)
        self._member.endpoints.subscribe(self._command_topic, self._on_command)
        for name in self._others:
            self._member.endpoints.subscribe(self._truth_topics[name], self._truth_callback(name))

    def run(self) -> None:
        """Fly the scenario.

        Raises:
            StopRequestedError: by a signal.
        """
        for step in self._member.steps():
            self._apply_parameters(step)
            if step == self._n_steps:
                self._parameters.close()
            truth = self._vehicle.advance(step, self._command(step - 1))
            self._publish(GROUND_TRUTH, odometry_to_msg(truth, self._name))
            ground_truth = self._others_truth(step) | {self._name: truth}
            self._publish_measurements(self._vehicle.measure(step, ground_truth))
            fault = self._vehicle.fault(step, ground_truth) or ""
            if fault:
                self._publish_event(step, FaultReported(fault))
            self._member.done(step, fault)

    def _apply_parameters(self, step: int) -> None:
        """Take over what was changed since the last step, and tell those who record."""
        if changes := self._parameters.take():
            self._vehicle.set_limits(self._parameters.tuning.config)
            self._publish_event(step, ParametersSet(changes))

    def _command(self, step: int) -> RotorCommand | None:
        """The command of a step, when it is known whether there is one."""
        if step < 0:
            return None
        self._member.wait(lambda: self._commands.has(step, self._member.announcements.sent(step)))
        command = self._commands.at(step).get(self._command_topic)
        self._member.announcements.close(step)
        self._commands.close(step)
        return command

    def _others_truth(self, step: int) -> dict[str, Odometry]:
        self._member.wait(lambda: len(self._truths.at(step)) == len(self._others))
        truths = {name: self._truths.at(step)[self._truth_topics[name]] for name in self._others}
        self._truths.close(step)
        return truths

    def _publish_measurements(self, measurements: VehicleMeasurements) -> None:
        for sensor in self._sensors:
            for measurement in measurements.arrived(sensor):
                self._publish(sensor.name, wire(sensor).to_msg(measurement, self._name))

    def _publish_event(self, step: int, content: ParametersSet | FaultReported) -> None:
        event = PerStep(step, step * self._period_ns, Event(self._name, content))
        self._member.publish(EVENTS, event_to_msg(event, self._team))

    def _publish(self, name: str, message: Any) -> None:
        self._member.publish(vehicle_topic(self._name, name), message)

    def _on_command(self, msg: RotorSpeedsMsg) -> None:
        command = rotor_command_from_msg(msg, self._name)
        self._commands.add(self._command_topic, command.stamp_ns, command)

    def _truth_callback(self, name: str) -> Callable[[OdometryMsg], None]:
        def on_truth(msg: OdometryMsg) -> None:
            truth = odometry_from_msg(msg, name)
            self._truths.add(self._truth_topics[name], truth.stamp_ns, truth)

        return on_truth


def _vehicle_name(node: Node, team: TeamConfig) -> str:
    namespace = node.get_namespace()
    if (name := namespace.strip("/")) not in team.vehicles:
        known = ", ".join(team.vehicles)
        raise ConfigError(
            f"namespace '{namespace}' is none of the vehicles {known}: add --ros-args -r __ns:=/<vehicle>"
        )
    return str(name)


def main() -> int:
    """Run the node."""
    return run_node(lambda: rclpy.create_node(VEHICLE_NODE), Quadrotor)
