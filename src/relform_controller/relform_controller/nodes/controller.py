"""Node of the formation controller: measurements of its vehicles in, rotor speeds out."""

import math
import sys
from collections import Counter
from collections.abc import Mapping
from functools import partial
from typing import Any

import rclpy
from rclpy.node import Node

from relform_controller.blas import one_blas_thread
from relform_controller.flight_director import FlightDirector
from relform_controller.live_values import FORMATION, LiveControllerValues, by_formation_key
from relform_controller.nodes.formation_service import FormationService
from relform_controller.nodes.requests import RequestServices
from relform_controller.team_controller import make_controller
from relform_core.load import LoadedScenario
from relform_core.measurements import RotorCommand, TeamMeasurements, VehicleMeasurements
from relform_core.names import (
    CONTROLLER_NODE,
    ROTOR_SPEEDS,
    EstimatorMode,
    SolverState,
    split_node_name,
    vehicle_topic,
)
from relform_core.roster import Controller, Roster
from relform_core.scenario_config import ScenarioConfig
from relform_core.sensors.applied_rotor_speeds import AppliedRotorSpeeds
from relform_core.telemetry import (
    AlarmRaised,
    Decision,
    EstimatorReport,
    Event,
    FormationSet,
    ParametersSet,
    PerStep,
    RequestMade,
    SeparationReport,
    Standby,
    StepDecided,
    TakenOver,
)
from relform_msgs.msg import FormationEvent
from relform_ros.commands import check_period, rotor_command_to_msg
from relform_ros.events import event_to_msg
from relform_ros.live_parameters import LiveParameters
from relform_ros.make_pacing import make_pacing
from relform_ros.pacing import Pacing
from relform_ros.parameters import read_observers, read_scenario
from relform_ros.run_node import Runnable, run_node
from relform_ros.sensors.wire import Wire, wire
from relform_ros.separation import separation_to_msg
from relform_ros.spinner import Spinner
from relform_ros.team_status import status_to_msg
from relform_ros.telemetry import reference_to_msg, solver_to_msg, state_to_msg

RENAMED = "leader: warning: this executable is now called controller: ros2 run relform_controller controller"


class ControllerNode:
    """Lets the controller decide once per step that it gets, on what the vehicles sent for it."""

    def __init__(self, node: Node, scenario: LoadedScenario, me: Controller, pacing: Pacing) -> None:
        config = scenario.config
        self._team = config.team
        self._n_steps = config.n_steps
        self._period_ns = config.period_ns
        self._me = me
        self._has_geofence = config.geofence is not None
        watches_separation = config.separation is not None
        self._telemetry = (
            *(me.state, me.solver, me.reference, me.events),
            *([me.separation] if watches_separation else []),
        )
        """No vehicle waits for these topics."""
        self._controller = make_controller(config, time_budget=_time_budget(config))
        self._parameters = LiveParameters(
            node, LiveControllerValues.from_scenario(scenario, self._controller.check_formation)
        )
        self._next_step = 0
        """The first step that was not decided yet; there a change takes effect."""
        self._solver_states: Counter[SolverState] = Counter()
        self._fallback_reason = ""
        self._estimator = EstimatorReport(EstimatorMode.MEASURED, "")
        """Of the newest decision."""
        self._rejected = 0
        """Measurements that the estimator has rejected in the flight."""
        self._separation: SeparationReport | None = None
        """Of the newest decision."""
        self._breach = ""
        """Of the newest decision, see there."""
        self._waiting_for = ""
        """What the start of the mission waits for; empty: it has started."""
        self._requests: RequestServices | None = None
        """None: the scenario has no take-off and landing."""
        if isinstance(self._controller, FlightDirector):
            self._requests = RequestServices(node, self._controller, self._open_step, self._period_ns)
        self._pacing = pacing
        self._topics = {
            vehicle: [(source, vehicle_topic(vehicle, source.name)) for source in config.sources_of(vehicle)]
            for vehicle in me.vehicles
        }
        """What each vehicle sends, with its topics."""
        for vehicle, sources in self._topics.items():
            for source, topic in sources:
                pacing.read(topic, partial(self._read, vehicle, wire(source)))
        FormationService(node, config, self._controller, self._parameters, lambda: self._next_step)

    async def run(self) -> None:
        """Control the flight.

        Raises:
            FlightError: what the start needs is missing for too long, the team cannot form up, or the flight
                is over too early.
            StopRequestedError: by a signal.
        """
        is_first = True
        async for step in self._pacing.steps():
            if is_first and self._pacing.joined_late:
                self._take_over(step)
            is_first = False
            gathered = await self._pacing.gather(step)
            is_over = step == self._n_steps or gathered.faulty
            decision = None if is_over else self._decide(step, gathered.messages)
            promised = self._telemetry if isinstance(decision, Decision) else ()
            self._pacing.done(step, promised=promised, report=self._report)
            # The commands are out: the rest runs while the vehicles fly the interval.
            if isinstance(decision, Decision):
                self._parameters.follow(by_formation_key(self._controller.formation))
                self._publish_telemetry(decision, _stamps(gathered.messages))
                self._controller.prepare_next()

    def _take_over(self, step: int) -> None:
        """Go on with a team in flight, which another process has controlled before."""
        print(f"{self._me.node}: takes the team over in step {step}", file=sys.stderr)
        self._controller.resume()
        self._next_step = step
        self._pacing.publish(self._me.events, self._event(step, TakenOver()))

    def _read(self, vehicle: str, its_wire: Wire, msg: Any) -> Any:
        """A measurement; raises RejectionError if it cannot be used."""
        measurement = its_wire.from_msg(msg, vehicle, self._team.vehicles)
        if isinstance(measurement, AppliedRotorSpeeds):
            check_period(measurement.period_ns, self._period_ns)
        return measurement

    def _decide(self, step: int, messages: Mapping[str, tuple[Any, ...]]) -> Decision | Standby:
        by_vehicle = {
            vehicle: VehicleMeasurements.collect(
                (source, measurement) for source, topic in sources for measurement in messages.get(topic, ())
            )
            for vehicle, sources in self._topics.items()
        }
        measurements = TeamMeasurements(step, step * self._period_ns, by_vehicle)
        self._apply_parameters(step)
        decision = self._controller.feedback(measurements)
        self._next_step = step + 1
        if self._next_step == self._n_steps:
            self._parameters.close()
        if isinstance(decision, Standby):
            self._publish_standby(step, decision, messages)
        else:
            self._note(decision)
            for alarm in decision.alarms:
                print(f"{self._me.node}: {alarm.source}: {alarm.description}", file=sys.stderr)
                self._pacing.publish(
                    self._me.events, self._event(step, AlarmRaised(alarm.description), alarm.source)
                )
        self._publish_commands(decision.commands)
        if isinstance(self._controller, FlightDirector):
            status = PerStep(step, measurements.arrival_ns, self._controller.status)
            self._pacing.publish(self._me.status, status_to_msg(status))
        return decision

    def _apply_parameters(self, step: int) -> None:
        """Apply what was changed since the last decision, and publish it as events, with the requests."""
        for request in () if self._requests is None else self._requests.take():
            self._pacing.publish(self._me.events, self._event(step, request))
        changes = self._parameters.take()
        live = self._parameters.live
        weights = {key: value for key, value in changes.items() if not key.startswith(FORMATION)}
        if weights:
            self._controller.set_weights(live.weights)
            self._pacing.publish(self._me.events, self._event(step, ParametersSet(weights)))
        if len(changes) > len(weights):
            self._controller.set_formation(live.formation)
            self._pacing.publish(self._me.events, self._event(step, FormationSet(live.formation)))

    def _publish_standby(self, step: int, standby: Standby, messages: Mapping[str, tuple[Any, ...]]) -> None:
        if not self._waiting_for:
            print(f"{self._me.node}: waits for {standby.reason}", file=sys.stderr)
        self._waiting_for = standby.reason
        content = StepDecided(_stamps(messages), sqp_steps=0, waiting_for=standby.reason)
        self._pacing.publish(self._me.events, self._event(step, content))

    def _note(self, decision: Decision) -> None:
        """Note what the diagnostics say about a decision."""
        self._waiting_for = decision.holds_for
        self._solver_states[decision.solver.state] += 1
        self._fallback_reason = decision.solver.fallback_reason or self._fallback_reason
        self._separation, self._breach = decision.separation, decision.breach
        if decision.state.estimator is not None:
            self._estimator = decision.state.estimator
            self._rejected += len(self._estimator.rejected)

    def _publish_commands(self, commands: Mapping[str, RotorCommand]) -> None:
        for vehicle, command in commands.items():
            topic = vehicle_topic(vehicle, ROTOR_SPEEDS)
            self._pacing.publish(topic, rotor_command_to_msg(command, vehicle), command)

    def _publish_telemetry(self, decision: Decision, inputs: tuple[tuple[str, int], ...]) -> None:
        step, stamp_ns = decision.step, decision.stamp_ns
        telemetry = [  # in the order of self._telemetry
            state_to_msg(PerStep(step, stamp_ns, decision.state)),
            solver_to_msg(PerStep(step, stamp_ns, decision.solver)),
            reference_to_msg(PerStep(step, stamp_ns, decision.reference)),
            self._event(step, StepDecided(inputs, decision.solver.sqp_steps)),
        ]
        if decision.separation is not None:
            telemetry.append(separation_to_msg(PerStep(step, stamp_ns, decision.separation)))
        for topic, message in zip(self._telemetry, telemetry, strict=True):
            self._pacing.publish(topic, message)

    def _event(
        self,
        step: int,
        content: StepDecided | FormationSet | ParametersSet | RequestMade | AlarmRaised | TakenOver,
        source: str | None = None,
    ) -> FormationEvent:
        event = PerStep(step, step * self._period_ns, Event(source or self._me.node, content))
        return event_to_msg(event, self._team)

    def _open_step(self) -> int | None:
        """The next step, in which a request applies; None: there is none."""
        return self._next_step if self._next_step < self._n_steps else None

    def _report(self) -> Mapping[str, object]:
        counts = {f"solver.{state.name.lower()}": self._solver_states[state] for state in SolverState}
        return counts | {
            "solver.last_fallback_reason": self._fallback_reason,
            "estimator.waiting_for": self._waiting_for,
            "estimator.mode": self._estimator.mode.name.lower(),
            "estimator.reason": self._estimator.reason,
            "estimator.nis": self._estimator.nis,
            "estimator.nis_dof": self._estimator.nis_dof,
            "estimator.rejected": self._rejected,
            "estimator.restarts": self._estimator.restarts,
            **({"geofence": self._breach} if self._has_geofence else {}),
            **self._report_of_separation(),
            **self._report_of_team(),
        }

    def _report_of_separation(self) -> Mapping[str, object]:
        """How far apart the vehicles are; nothing where it is not watched, or not known yet."""
        if self._separation is None:
            return {}
        return {"separation.level": self._separation.level.name.lower(), "separation": str(self._separation)}

    def _report_of_team(self) -> Mapping[str, object]:
        """What the team does; nothing where it has no take-off and landing."""
        if self._requests is None or not isinstance(self._controller, FlightDirector):
            return {}
        status = self._controller.status
        return {
            "requests.refused": self._requests.refused,
            "team.mode": str(status.mode),
            "team.reason": status.reason,
        }


def _stamps(messages: Mapping[str, tuple[Any, ...]]) -> tuple[tuple[str, int], ...]:
    """Topic and stamp [ns] of each message."""
    return tuple((topic, message.stamp_ns) for topic, each in messages.items() for message in each)


def _time_budget(config: ScenarioConfig) -> float:
    """Time after which no further SQP step of a decision begins [s]."""
    return math.inf if config.real_time is None else config.real_time.solver_share * config.controller.period


def build_controller(node: Node, spinner: Spinner) -> Runnable:
    """A controller, by the parameters of the node.

    Raises:
        ConfigError: a parameter is missing or not usable, or the node is no controller of the scenario.
    """
    scenario = read_scenario(node)
    roster = Roster.of(scenario.config, read_observers(node))
    pacing = make_pacing(node, spinner, scenario, roster)
    return ControllerNode(node, scenario, roster.controller_at(node.get_fully_qualified_name()), pacing)


def main() -> int:
    """Run the node."""
    namespace, name = split_node_name(CONTROLLER_NODE)
    with one_blas_thread():
        return run_node(lambda: rclpy.create_node(name, namespace=namespace), build_controller)


def main_of_leader() -> int:
    """Run the node by its former name."""
    print(RENAMED, file=sys.stderr)
    return main()
