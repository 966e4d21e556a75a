"""The formation controller on the wire: a complete set of measurements in, rotor speeds for the team out."""

import math
from collections import Counter
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import rclpy
from rclpy.node import Node

from relform_controller.blas import one_blas_thread
from relform_controller.formation_controller import Decision, FormationController
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
from relform_core.scenario_config import TeamConfig
from relform_core.schema import Vector3
from relform_msgs.msg import (
    FormationEvent,
    FormationReference,
    FormationState,
    PairState,
    RelativePosition,
    SolverStatus,
)
from relform_msgs.srv import SetFormation
from relform_ros.conversions import rotor_command_to_msg
from relform_ros.events import parameters_to_msg
from relform_ros.fields import (
    WORLD_FRAME,
    header_to_msg,
    point_to_msg,
    stamp_to_msg,
    vector_from_msg,
    vector_to_msg,
)
from relform_ros.live_parameters import LiveParameters
from relform_ros.lockstep import StepInbox
from relform_ros.member import LockstepMember
from relform_ros.parameters import read_observers, read_scenario
from relform_ros.run_node import Spinner, run_node
from relform_ros.sensors.wire import Wire, wire

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
            self._member.publish(EVENTS, parameters_to_msg(step, self._period_ns, CONTROLLER_NODE, weights))
        if len(changes) > len(weights):
            self._controller.set_formation(tuning.formation)
            event = FormationEvent(
                header=header_to_msg(step * self._period_ns),
                step=step,
                kind=FormationEvent.SET_FORMATION,
                source=CONTROLLER_NODE,
                description="requested by service or parameters",
                formation=formation_to_msgs(tuning.formation, self._team),
            )
            self._member.publish(EVENTS, event)

    def _publish_telemetry(self, decision: Decision, input_topics: list[str]) -> None:
        event = FormationEvent(
            header=header_to_msg(decision.stamp_ns),
            step=decision.step,
            kind=FormationEvent.STEP,
            source=CONTROLLER_NODE,
            input_topics=input_topics,
            input_stamps=[stamp_to_msg(decision.stamp_ns)] * len(input_topics),
            sqp_steps=decision.solver.sqp_steps,
        )
        telemetry = (state_to_msg(decision), solver_to_msg(decision), reference_to_msg(decision), event)
        for topic, message in zip(TELEMETRY, telemetry, strict=True):
            self._member.fulfil(topic, message)

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


def formation_from_msgs(msgs: list[RelativePosition], team: TeamConfig) -> dict[str, Vector3]:
    """Position of each follower relative to the leader.

    Raises:
        MessageError: the observer is not the leader, a target is named twice, or a position is not finite.
    """
    formation: dict[str, Vector3] = {}
    for msg in msgs:
        if msg.observer_id != team.leader:
            raise MessageError(f"observer_id must be the leader '{team.leader}' (got '{msg.observer_id}')")
        if msg.target_id in formation:
            raise MessageError(f"target_id '{msg.target_id}' is named twice")
        x, y, z = vector_from_msg(msg.position, f"position of '{msg.target_id}'").tolist()
        formation[msg.target_id] = (x, y, z)
    return formation


def formation_to_msgs(formation: Mapping[str, Vector3], team: TeamConfig) -> list[RelativePosition]:
    """Position of each follower relative to the leader."""
    return [
        RelativePosition(
            observer_id=team.leader, target_id=follower, position=vector_to_msg(np.array(formation[follower]))
        )
        for follower in team.followers
    ]


def state_to_msg(decision: Decision) -> FormationState:
    """The team as the controller sees it."""
    formation_state = FormationState(
        header=header_to_msg(decision.stamp_ns),
        step=decision.step,
        phase=decision.reference.phase,
        leader_position_error=decision.leader_position_error,
        leader_yaw_error=decision.leader_yaw_error,
    )
    formation_state.pairs = [
        PairState(
            observer_id=pair.observer,
            target_id=pair.target,
            position=vector_to_msg(pair.p_B1B2_C1__est),
            reference=vector_to_msg(pair.p_B1B2_C1__ref),
            error=math.dist(pair.p_B1B2_C1__est, pair.p_B1B2_C1__ref),
            yaw=pair.yaw_I1I2,
            yaw_variance=pair.yaw_variance,
            yaw_held=pair.yaw_held,
        )
        for pair in decision.pairs
    ]
    return formation_state


def solver_to_msg(decision: Decision) -> SolverStatus:
    """What the solver did."""
    report = decision.solver
    return SolverStatus(
        header=header_to_msg(decision.stamp_ns),
        step=decision.step,
        status=int(report.state),
        fallback_reason=report.fallback_reason,
        objective=float(report.objective),
        kkt_first=float(report.kkt_first),
        kkt=float(report.kkt),
        sqp_steps=report.sqp_steps,
        qp_iterations=report.qp_iterations,
        active_bounds=report.active_bounds,
        prepare_time=report.prepare_time,
        feedback_time=report.feedback_time,
    )


def reference_to_msg(decision: Decision) -> FormationReference:
    """What the controller was asked to track."""
    reference = decision.reference
    return FormationReference(
        header=header_to_msg(decision.stamp_ns, WORLD_FRAME),
        step=decision.step,
        phase=reference.phase,
        leader_position=point_to_msg(reference.p_NB_N),
        leader_velocity=vector_to_msg(reference.v_NB_N),
        leader_yaw=reference.yaw_NB,
        formation=[
            RelativePosition(observer_id=observer, target_id=target, position=vector_to_msg(position))
            for (observer, target), position in reference.formation.items()
        ],
    )


def main() -> int:
    """Run the node."""
    namespace, name = split_node_name(CONTROLLER_NODE)
    with one_blas_thread():
        return run_node(lambda: rclpy.create_node(name, namespace=namespace), Leader)
