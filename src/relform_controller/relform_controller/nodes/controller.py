"""The formation controller on the wire: a complete set of measurements in, rotor speeds for the team out."""

from collections import Counter
from collections.abc import Callable, Mapping
from typing import Any

import rclpy
from rclpy.node import Node

from relform_controller.blas import one_blas_thread
from relform_controller.formation_controller import FormationController
from relform_controller.tuning import FORMATION, ControllerTuning, by_formation_key
from relform_core.errors import ConfigError, MessageError
from relform_core.measurements import TeamMeasurements, VehicleMeasurements
from relform_core.names import (
    CONTROLLER_NODE,
    EVENTS,
    REFERENCE,
    ROTOR_SPEEDS,
    SOLVER,
    STATE,
    SolverState,
    split_node_name,
    vehicle_topic,
)
from relform_core.telemetry import Decision, Event, FormationSet, ParametersSet, PerStep, StepDecided
from relform_msgs.msg import FormationEvent
from relform_msgs.srv import SetFormation
from relform_ros.commands import rotor_command_to_msg
from relform_ros.events import event_to_msg, formation_from_msgs
from relform_ros.live_parameters import LiveParameters
from relform_ros.lockstep import StepInbox
from relform_ros.member import LockstepMember
from relform_ros.parameters import read_observers, read_scenario
from relform_ros.run_node import Spinner, run_node
from relform_ros.sensors.wire import Wire, wire
from relform_ros.telemetry import reference_to_msg, solver_to_msg, state_to_msg

TELEMETRY = (STATE, SOLVER, REFERENCE, EVENTS)
"""For observers; no vehicle waits for it."""


class Leader:
    """Lets the controller decide once per step, as soon as all that the vehicles sent is there."""

    def __init__(self, node: Node, spinner: Spinner) -> None:
        scenario = read_scenario(node)
        config = scenario.config
        self._config = config
        self._team = config.team
        self._n_steps = config.n_steps
        self._period_ns = config.period_ns
        self._parameters = LiveParameters(node, ControllerTuning.from_scenario(scenario))
        self._controller = FormationController(config)
        self._next_step = 0
        """The first step that was not decided yet; there a change takes effect."""
        self._solver_states: Counter[SolverState] = Counter()
        self._fallback_reason = ""
        topics = {
            vehicle_topic(vehicle, sensor.name): (vehicle, wire(sensor))
            for vehicle in self._team.vehicles
            for sensor in config.sensors_of(vehicle)
        }
        self._inbox = StepInbox[Any](topics, self._period_ns)
        self._member = LockstepMember(node, spinner, scenario, read_observers(node))
        self._member.report = self._report
        for topic, (vehicle, conversion) in topics.items():
            self._member.endpoints.subscribe(topic, self._measurement_callback(topic, vehicle, conversion))
        node.create_service(SetFormation, "set_formation", self._on_set_formation)

    def run(self) -> None:
        """Control the flight.

        Raises:
            FlightError: the first measurements do not suffice to start.
            StopRequestedError: by a signal.
        """
        for step in self._member.steps():
            self._wait_for_measurements(step)
            if step < self._n_steps and not self._member.announcements.faulty(step):
                decision = self._decide(step)
                self._member.done(step, promised=TELEMETRY)
                # The commands are out: the rest goes on while the vehicles fly the interval.
                self._publish_telemetry(decision, list(self._inbox.at(step)))
                self._controller.prepare_next()
            else:
                self._member.done(step)
            self._inbox.close(step)
            self._member.announcements.close(step)

    def _wait_for_measurements(self, step: int) -> None:
        self._member.wait(lambda: self._inbox.has(step, self._member.announcements.sent(step)))

    def _decide(self, step: int) -> Decision:
        messages = self._inbox.at(step)
        by_vehicle = {
            vehicle: VehicleMeasurements.collect(
                (sensor, messages[topic])
                for sensor in self._config.sensors_of(vehicle)
                if (topic := vehicle_topic(vehicle, sensor.name)) in messages
            )
            for vehicle in self._team.vehicles
        }
        measurements = TeamMeasurements(step, step * self._period_ns, by_vehicle)
        self._apply_parameters(step)
        decision = self._controller.feedback(measurements)
        self._parameters.follow(by_formation_key(self._controller.formation))
        self._next_step = step + 1
        if self._next_step == self._n_steps:
            self._parameters.close()
        self._solver_states[decision.solver.state] += 1
        self._fallback_reason = decision.solver.fallback_reason or self._fallback_reason
        for vehicle, command in decision.commands.items():
            topic = vehicle_topic(vehicle, ROTOR_SPEEDS)
            self._member.publish(topic, rotor_command_to_msg(command, vehicle))
        return decision

    def _apply_parameters(self, step: int) -> None:
        """Pass on what was changed since the last decision, and tell those who record."""
        changes = self._parameters.take()
        tuning = self._parameters.tuning
        weights = {key: value for key, value in changes.items() if not key.startswith(FORMATION)}
        if weights:
            self._controller.set_weights(tuning.weights)
            self._member.publish(EVENTS, self._event(step, ParametersSet(weights)))
        if len(changes) > len(weights):
            self._controller.set_formation(tuning.formation)
            self._member.publish(EVENTS, self._event(step, FormationSet(tuning.formation)))

    def _publish_telemetry(self, decision: Decision, input_topics: list[str]) -> None:
        step, stamp_ns = decision.step, decision.stamp_ns
        inputs = tuple((topic, stamp_ns) for topic in input_topics)
        telemetry = (
            state_to_msg(PerStep(step, stamp_ns, decision.state)),
            solver_to_msg(PerStep(step, stamp_ns, decision.solver)),
            reference_to_msg(PerStep(step, stamp_ns, decision.reference)),
            self._event(step, StepDecided(inputs, decision.solver.sqp_steps)),
        )
        for topic, message in zip(TELEMETRY, telemetry, strict=True):
            self._member.fulfil(topic, message)

    def _event(self, step: int, content: StepDecided | FormationSet | ParametersSet) -> FormationEvent:
        event = PerStep(step, step * self._period_ns, Event(CONTROLLER_NODE, content))
        return event_to_msg(event, self._team)

    def _measurement_callback(self, topic: str, vehicle: str, conversion: Wire) -> Callable[[Any], None]:
        def on_measurement(msg: Any) -> None:
            measurement = conversion.from_msg(msg, vehicle, self._team.vehicles)
            self._inbox.add(topic, measurement.stamp_ns, measurement)

        return on_measurement

    def _on_set_formation(
        self, request: SetFormation.Request, response: SetFormation.Response
    ) -> SetFormation.Response:
        try:
            formation = formation_from_msgs(request.formation, self._team)
            if problem := self._config.formation_problem(formation):
                raise ConfigError(f"formation {problem}")
            self._parameters.change(by_formation_key(formation))
        except (ConfigError, MessageError) as error:
            response.success = False
            response.message = str(error)
            return response
        response.success = True
        response.message = f"applies from step {self._next_step} on"
        return response

    def _report(self) -> Mapping[str, object]:
        counts = {f"solver.{state.name.lower()}": self._solver_states[state] for state in SolverState}
        return counts | {"solver.last_fallback_reason": self._fallback_reason}


def main() -> int:
    """Run the node."""
    namespace, name = split_node_name(CONTROLLER_NODE)
    with one_blas_thread():
        return run_node(lambda: rclpy.create_node(name, namespace=namespace), Leader)
