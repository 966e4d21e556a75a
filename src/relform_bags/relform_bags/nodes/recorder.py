"""The recorder: in a flight a member of the barrier, so that a slow disk slows the flight and loses nothing.

A recorder that the flight does not know (parameter ``observers``) records what it discovers instead.
"""

import json
from collections.abc import Sequence
from functools import partial

import rclpy
from rclpy.node import Node

from relform_bags.nodes.discovering import DiscoveringRecorder
from relform_bags.nodes.option_parameters import read_options
from relform_bags.nodes.recording import QUIET_S, Recording
from relform_bags.options import RecorderOptions
from relform_core.errors import BagError
from relform_core.installed import software_versions
from relform_core.load import LoadedScenario
from relform_core.names import CONFIG_ATTACHMENT, RECORDER_NODE, VERSIONS_ATTACHMENT, split_node_name
from relform_core.roster import Roster
from relform_ros.lockstep_pacing import LockstepPacing
from relform_ros.pacing import Pacing
from relform_ros.parameters import read_observers, read_scenario
from relform_ros.raw import raw_stamp_ns
from relform_ros.run_node import Runnable, Spinner, run_node
from relform_ros.topics import Topic


class FlightRecorder:
    """Writes all messages of a flight; their log time is their stamp, the instant of the step."""

    def __init__(self, node: Node, spinner: Spinner, scenario: LoadedScenario, pacing: Pacing) -> None:
        self._node = node
        self._spinner = spinner
        self._scenario = scenario
        self._options = read_options(node, RecorderOptions)
        self._pacing = pacing

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
        pacing, chosen = self._pacing, self._options.selection
        topics = [topic for topic in pacing.readable if chosen.takes(topic.name, _type_name(topic))]
        for topic in topics:
            pacing.watch(topic.name, partial(_take, recording, topic))
        for step in pacing.steps():
            for topic in topics if step == 0 else ():  # a topic without any message is in the bag as well
                recording.add_topic(topic.name, _type_name(topic))
            pacing.gather(step)
            if recording.is_full:
                self._spinner.drain(QUIET_S)  # for what nodes sent that this one does not wait for
                try:
                    recording.close()
                except BagError as error:
                    pacing.done(step, fault=str(error))
                    pacing.leave()
                    raise
            pacing.done(step)


def _take(recording: Recording, topic: Topic, data: bytes, publish_time_ns: int) -> None:
    recording.add_topic(topic.name, _type_name(topic))
    recording.write(topic.name, data, raw_stamp_ns(data), publish_time_ns)


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
        scenario = read_scenario(node)
        pacing = LockstepPacing(node, spinner, scenario, Roster.of(scenario.config, observers))
        return FlightRecorder(node, spinner, scenario, pacing)
    return DiscoveringRecorder(node, spinner)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the node; its command line is that of the process unless it is given."""
    _, name = split_node_name(RECORDER_NODE)
    return run_node(lambda: rclpy.create_node(name, enable_rosout=False), build_recorder, arguments=arguments)
