"""Record a flight as a member of the barrier: a slow disk slows the flight, and no message is lost."""

import json
from contextlib import nullcontext
from functools import partial

from rclpy.node import Node

from relform_bags.nodes.open_bag import QUIET_S, OpenBag
from relform_bags.nodes.option_parameters import read_options
from relform_bags.options import RecorderOptions
from relform_core.errors import BagError
from relform_core.installed import software_versions
from relform_core.load import LoadedScenario
from relform_core.names import CONFIG_ATTACHMENT, VERSIONS_ATTACHMENT
from relform_ros.pacing import Pacing
from relform_ros.raw import raw_stamp_ns
from relform_ros.spinner import Spinner
from relform_ros.step_pipe import read_step_pipe
from relform_ros.topics import Topic


class FlightRecorder:
    """Writes all messages of a flight; their log time is their stamp, the instant of the step.

    With the parameter ``pipe``, it also hands the messages of each step to the process that has started it.
    """

    def __init__(self, node: Node, spinner: Spinner, scenario: LoadedScenario, pacing: Pacing) -> None:
        self._node = node
        self._spinner = spinner
        self._scenario = scenario
        self._options = read_options(node, RecorderOptions)
        self._pacing = pacing
        self._pipe = read_step_pipe(node)

    async def run(self) -> None:
        """Record to the end of the flight.

        Raises:
            BagError: the bag cannot be created or written; the recorder has reported a fault to the flight.
            StopRequestedError: after a signal, or when nobody reads the pipe any more; the bag is closed.
        """
        attachments = {
            CONFIG_ATTACHMENT: self._scenario.effective_yaml,
            VERSIONS_ATTACHMENT: json.dumps(software_versions(), indent=2),
        }
        bag = OpenBag(self._node, self._spinner, self._options, attachments)
        try:
            with self._pipe or nullcontext():
                await self._record(bag)
        finally:
            bag.close()

    async def _record(self, bag: OpenBag) -> None:
        pacing, chosen = self._pacing, self._options.selection
        types = {topic.name: _type_name(topic) for topic in pacing.readable}
        topics = {name: type_name for name, type_name in types.items() if chosen.takes(name, type_name)}
        for name, type_name in topics.items():
            pacing.watch(name, partial(_take, bag, name, type_name))
        async for step in pacing.steps():
            for name, type_name in topics.items() if step == 0 else ():  # also topics without messages
                bag.add_topic(name, type_name)
            gathered = await pacing.gather(step)
            if self._pipe is not None:
                messages = gathered.messages.items()
                self._pipe.send([(topic, data) for topic, each in messages for data in each])
            if bag.is_full:
                self._spinner.drain(QUIET_S)  # take the messages of nodes that this one does not wait for
                try:
                    bag.close()
                except BagError as error:
                    pacing.done(step, fault=str(error))
                    await pacing.leave()
                    raise
            pacing.done(step)


def _take(bag: OpenBag, name: str, type_name: str, data: bytes, publish_time_ns: int) -> None:
    bag.add_topic(name, type_name)
    bag.write(name, data, raw_stamp_ns(data), publish_time_ns)


def _type_name(topic: Topic) -> str:
    package = topic.type.__module__.partition(".")[0]
    return f"{package}/msg/{topic.type.__name__}"
