"""The clock of a flight: owns /clock, and decides when a step begins.

Its exit codes are those of ``relform_core.exit_codes.NodeExit``.
"""

import sys
import time
from collections.abc import Callable
from functools import partial

import rclpy
from rcl_interfaces.srv import GetParameters
from rclpy.node import Node
from rclpy.task import Future
from rosgraph_msgs.msg import Clock

from relform_core.errors import FlightError
from relform_core.exit_codes import NodeExit
from relform_core.names import (
    CLOCK,
    CLOCK_NODE,
    DIAGNOSTICS,
    MEMBERS,
    split_node_name,
    step_done_topic,
    vehicle_node,
)
from relform_core.nodes_config import NodeParameters
from relform_core.roster import Roster
from relform_msgs.msg import StepDone
from relform_ros.barrier import Barrier, SilentNodeError, VehicleFaultError
from relform_ros.diagnostics import Diagnostics, is_due
from relform_ros.discovery import DISCOVERY_POLL_S, check_name, discover
from relform_ros.endpoints import Endpoints
from relform_ros.fields import stamp_to_msg
from relform_ros.flight_pacing import configuration_of
from relform_ros.member_changes import change_to_msg
from relform_ros.membership import MemberChange, Verdict
from relform_ros.metronome import Metronome
from relform_ros.parameters import read_described, read_observers, read_scenario
from relform_ros.run_node import run_node
from relform_ros.spinner import Spinner, until, until_instant
from relform_ros.step_done import done_from_msg
from relform_ros.topics import topic_table

ANSWER_S = 1.0
"""How long a node may take to answer when the clock checks that it responds."""
EXIT_CODES = {SilentNodeError: NodeExit.SILENT_MEMBER, VehicleFaultError: NodeExit.MEMBER_FAULT}


class ClockServer:
    """Ticks when all members have finished the step before, or in real time when the period is over."""

    def __init__(self, node: Node, spinner: Spinner) -> None:
        scenario = read_scenario(node)
        config = scenario.config
        roster = Roster.of(config, read_observers(node))
        self._name = node.get_fully_qualified_name()
        check_name(self._name, (CLOCK_NODE,))
        self._node = node
        self._config = config
        self._endpoints = Endpoints(node, topic_table(config, roster), spinner.intra_process)
        self._diagnostics = Diagnostics(self._name, self._endpoints.rejections)
        self._members = roster.members
        for member in self._members:
            self._endpoints.subscribe(step_done_topic(member), partial(self._on_step_done, member))
        make_barrier: Callable[..., Barrier] = Barrier
        if config.real_time is not None:
            controllers = [controller.node for controller in roster.controllers]
            make_barrier = partial(
                Metronome,
                world=map(vehicle_node, roster.vehicles),
                controllers=controllers,
                replaceable=(*controllers, *roster.observers),
            )
        self._barrier = make_barrier(
            self._members,
            roster.observers,
            configuration=configuration_of(scenario, roster),
            n_steps=config.n_steps,
            period=config.controller.period,
            start_timeout=read_described(node, "start_timeout_s", NodeParameters().start_timeout),
            step_timeout=config.lockstep.step_timeout,
            now=time.monotonic,
        )

    async def run(self) -> None:
        """Tick until the flight is over.

        Raises:
            FlightError: a node that does not belong to the flight could be mistaken for a member.
            DisagreementError: a member flies another configuration.
            SilentNodeError: a member did not finish a step in time.
            VehicleFaultError: a member reported a fault.
            StopRequestedError: by a signal.
        """
        try:
            await self._tick()
        except SilentNodeError as error:
            # Most late members wait for another one themselves. That one may have reported to the clock and
            # fallen silent before its message to the others.
            unresponsive = await self._unresponsive()
            lost = [name for name in unresponsive if not self._barrier.has_finished(name)]
            raise SilentNodeError(error.what, lost or error.nodes) from None

    async def _tick(self) -> None:
        await discover(self._name, self._endpoints, is_ready=self._barrier.complete)
        if intruders := self._endpoints.intruders():
            raise FlightError(f"{'; '.join(intruders)}: stop the nodes that do not belong to this flight")
        while (step := self._barrier.advance()) <= self._config.n_steps:
            stamp_ns = step * self._config.period_ns
            self._endpoints.publish(CLOCK, Clock(clock=stamp_to_msg(stamp_ns)))
            if is_due(step, self._config.period_ns):
                report = self._diagnostics.report(stamp_ns, self._barrier.report())
                self._endpoints.publish(DIAGNOSTICS, report)
            await until_instant(self._barrier.due())
            await until(self._may_tick)

    def _may_tick(self) -> bool:
        """Whether the next step may begin; publishes meanwhile who joins."""
        is_complete = self._barrier.complete()
        for change in self._barrier.take_changes():
            msg = change_to_msg(change, change.step * self._config.period_ns)
            self._endpoints.publish(MEMBERS, msg)
            print(f"{self._name}: step {change.step}: {_in_words(change)}", file=sys.stderr)
        return is_complete

    async def _unresponsive(self) -> list[str]:
        """The members that do not answer a request for a parameter."""
        clients = {
            name: self._node.create_client(GetParameters, f"{name}/get_parameters") for name in self._members
        }
        answers: dict[str, Future] = {}
        deadline = time.monotonic() + ANSWER_S

        def is_over() -> bool:
            for name in self._members:
                if name not in answers and clients[name].service_is_ready():
                    answers[name] = clients[name].call_async(GetParameters.Request(names=["scenario"]))
            answered = all(name in answers and answers[name].done() for name in self._members)
            return answered or time.monotonic() > deadline

        await until(is_over, DISCOVERY_POLL_S)
        return [name for name in self._members if name not in answers or not answers[name].done()]

    def _on_step_done(self, member: str, msg: StepDone) -> None:
        self._barrier.add(done_from_msg(msg, member))


def _in_words(change: MemberChange) -> str:
    verb = "admitted" if change.verdict is Verdict.ADMITTED else "refused"
    return f"{verb} another process as {change.node}: {change.reason}"


def create_clock() -> Node:
    """The node, without its logic."""
    namespace, name = split_node_name(CLOCK_NODE)
    return rclpy.create_node(name, namespace=namespace)


def main() -> int:
    """Run the node."""
    return run_node(create_clock, ClockServer, EXIT_CODES)
