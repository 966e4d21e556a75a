"""The recorder: in a flight a member of the barrier, so that a slow disk slows the flight and loses nothing.

A recorder that the flight does not know (parameter ``observers``) records what it discovers instead.
"""

import json
from collections.abc import Callable, Sequence
from contextlib import suppress

import rclpy
from rclpy.node import Node

from relform_bags.nodes.discovering import DiscoveringRecorder
from relform_bags.nodes.option_parameters import read_options
from relform_bags.nodes.recording import QUIET_S, Recording
from relform_bags.options import RecorderOptions
from relform_core.errors import BagError
from relform_core.installed import software_versions
from relform_core.names import CONFIG_ATTACHMENT, RECORDER_NODE, VERSIONS_ATTACHMENT, split_node_name
from relform_ros.lockstep import StepTally
from relform_ros.member import FAREWELL_S, LockstepMember
from relform_ros.parameters import read_observers, read_scenario
from relform_ros.raw import raw_stamp_ns
from relform_ros.rejection import RejectionError
from relform_ros.run_node import Runnable, Spinner, run_node
from relform_ros.topics import Topic


class FlightRecorder:
    """Writes all messages of a flight; their log time is their stamp, the instant of the step."""

    def __init__(self, node: Node, spinner: Spinner, observers: tuple[str, ...]) -> None:
        self._node = node
        self._spinner = spinner
        self._scenario = read_scenario(node)
        self._options = read_options(node, RecorderOptions)
        self._period_ns = self._scenario.config.period_ns
        self._member = LockstepMember(node, spinner, self._scenario, observers)

    def run(self) -> None:
        """Record to the end of the flight.

        Raises:
            BagError: the bag cannot be created or written; the flight is told.
            StopRequestedError: by a signal; the bag is closed first.
        """
        attachments = {
            CONFIG_ATTACHMENT: self._scenario.effective_yaml,
            VERSIONS_ATTACHMENT: json.dumps(software_versions(), indent=2),
        }
        recording = Recording(self._node, self._spinner, self._options, attachments)
        try:
            self._record(recording)
        finally:
            recording.close()

    def _record(self, recording: Recording) -> None:
        endpoints, announcements = self._member.endpoints, self._member.announcements
        chosen = self._options.selection
        topics = [topic for topic in endpoints.readable if chosen.takes(topic.name, _type_name(topic))]
        tally = StepTally([topic.name for topic in topics], self._period_ns)
        for topic in topics:
            endpoints.subscribe_raw(topic.name, _taker(topic, recording, tally))
        for step in self._member.steps():
            for topic in topics if step == 0 else ():  # a topic without any message is in the bag as well
                recording.add_topic(topic.name, _type_name(topic))
            self._member.wait(
                # Nobody calls it after this turn of the loop, so it may see the variable of the loop.
                lambda: tally.has(step, announcements.sent(step))  # noqa: B023
            )
            if recording.is_full:
                self._spinner.drain(QUIET_S)  # for what nodes sent that this one does not wait for
                try:
                    recording.close()
                except BagError as error:
                    self._member.done(step, fault=str(error))
                    endpoints.wait_until_received(FAREWELL_S)
                    raise
            tally.close(step)
            announcements.close(step)
            self._member.done(step)


def _taker(topic: Topic, recording: Recording, tally: StepTally) -> Callable[[bytes, int], None]:
    name, type_name = topic.name, _type_name(topic)

    def take(data: bytes, publish_time_ns: int) -> None:
        stamp_ns = raw_stamp_ns(data)
        recording.add_topic(name, type_name)
        recording.write(name, data, stamp_ns, publish_time_ns)
        with suppress(RejectionError):  # a step that is over does not miss it, but the bag has it
            tally.add(name, stamp_ns)

    return take


def _type_name(topic: Topic) -> str:
    package = topic.type.__module__.partition(".")[0]
    return f"{package}/msg/{topic.type.__name__}"


def build_recorder(node: Node, spinner: Spinner) -> Runnable:
    """The recorder that this node is to be.

    Raises:
        ConfigError: a parameter is missing or not usable.
    """
    observers = read_observers(node)
    if node.get_fully_qualified_name() in observers:
        return FlightRecorder(node, spinner, observers)
    return DiscoveringRecorder(node, spinner)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the node; its command line is that of the process unless it is given."""
    _, name = split_node_name(RECORDER_NODE)
    return run_node(lambda: rclpy.create_node(name, enable_rosout=False), build_recorder, arguments=arguments)
