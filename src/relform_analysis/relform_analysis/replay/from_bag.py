"""What a recorded flight's controller was given and what it answered, step by step, from a bag.

Messages are found by the stamp in their header: the log time of a bag is wall time for most recorders.
"""

from collections import defaultdict
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any

from relform_analysis.flight.bag_configuration import find_configuration
from relform_analysis.replay.replay import RecordedFlight, RecordedStep
from relform_bags.from_bag import decode
from relform_bags.reader import BagMessage, find_bag, read_bag
from relform_core.errors import BagError, MessageError
from relform_core.measurements import TeamMeasurements, VehicleMeasurements
from relform_core.names import ROTOR_SPEEDS, vehicle_topic
from relform_core.roster import Controller, Roster
from relform_core.scenario_config import ScenarioConfig
from relform_core.telemetry import (
    Event,
    FormationSet,
    ParametersSet,
    PerStep,
    RequestMade,
    StepDecided,
    TakenOver,
)
from relform_core.units import NANOSECONDS_PER_SECOND
from relform_ros.commands import rotor_command_from_msg
from relform_ros.events import event_from_msg
from relform_ros.raw import raw_stamp_ns
from relform_ros.rejection import RejectionError
from relform_ros.sensors.wire import wire


def read_recorded_flight(path: Path | str, configuration: Path | str | None = None) -> RecordedFlight:
    """Read a flight, from its first control step to the last one that the bag holds whole.

    Args:
        path: the bag's file or folder, or the folder of the run.
        configuration: path or plain name of the scenario; None: as ``find_configuration`` finds it.
    Raises:
        BagError: one line: there is no bag, no configuration or no first control step, or a message cannot
            be used.
    """
    bag = find_bag(path)
    found = find_configuration(bag, configuration)
    scenario = found.load()
    try:
        recording = _Recording(bag, scenario.config, Roster.of(scenario.config).controllers[0])
        steps: list[RecordedStep] = []
        step = recording.first
        while (gap := recording.gap(step)) is None:
            steps.append(recording.step(step))
            step = recording.following(step)
    except MessageError as error:
        raise BagError(f"{bag}: {error}") from None
    if not steps:
        raise BagError(f"{bag}: no replay: {gap}")
    return RecordedFlight(found, scenario, tuple(steps), gap or None)


class _Recording:
    """The messages of a flight that one controller read and wrote, by topic and stamp."""

    def __init__(self, bag: Path, config: ScenarioConfig, controller: Controller) -> None:
        self._config = config
        self._controller = controller
        self._messages: defaultdict[tuple[str, int], list[BagMessage]] = defaultdict(list)
        self._decided: dict[int, StepDecided] = {}
        self._formations: dict[int, FormationSet] = {}
        self._parameters: dict[int, ParametersSet] = {}
        self._taken_over: set[int] = set()
        self._requests: defaultdict[int, list[RequestMade]] = defaultdict(list)
        self._sources = {
            vehicle_topic(vehicle, source.name): (vehicle, source)
            for vehicle in config.team.vehicles
            for source in config.sources_of(vehicle)
        }
        self._commands = {vehicle: vehicle_topic(vehicle, ROTOR_SPEEDS) for vehicle in controller.vehicles}
        for entry in read_bag(bag, {controller.events, *self._sources, *self._commands.values()}):
            if not isinstance(entry, BagMessage):
                continue
            with suppress(RejectionError):  # nobody has used it
                if entry.topic == controller.events:
                    self._add_event(event_from_msg(decode(entry), config.team))
                else:
                    self._messages[entry.topic, raw_stamp_ns(entry.data)].append(entry)
        self._last = max(self._decided, default=-1)

    @property
    def first(self) -> int:
        """The first control step of the controller, if the bag holds the flight from its start."""
        holds_start = any(stamp_ns == 0 for _, stamp_ns in self._messages)
        return self.following(-1) if holds_start else 0

    def following(self, step: int) -> int:
        """The next control step; in real time a controller that is late leaves steps out."""
        if self._config.real_time is not None:
            for later in range(step + 1, self._last + 1):
                if later in self._decided or self._is_answered(later):
                    return later
        return step + 1

    def _is_answered(self, step: int) -> bool:
        """Whether the bag holds a command of a control step."""
        return any((topic, self._answer_ns(step)) in self._messages for topic in self._commands.values())

    def gap(self, step: int) -> str | None:
        """Why this step cannot be replayed, in words; empty: the flight ended before; None: it can."""
        if step not in self._decided:
            if not self._decided:
                return f"there is no control step on {self._controller.events}"
            if step < min(self._decided):
                return f"the recording starts at control step {min(self._decided)}, and a replay at step 0"
            return (
                f"{self._named(step)} is not on {self._controller.events}"
                if step < max(self._decided)
                else ""
            )
        inputs = self._decided[step].inputs
        for topic, _ in inputs:
            if topic not in self._sources:
                return f"{self._named(step)} used {topic}, which is no sensor of the configuration"
        answers = ((topic, self._answer_ns(step)) for topic in self._answers(step).values())
        for topic, stamp_ns in (*inputs, *answers):
            if (topic, stamp_ns) not in self._messages:
                time = stamp_ns / NANOSECONDS_PER_SECOND
                return f"{self._named(step)} lacks the message on {topic} of {time:.2f} s"
        return None

    def step(self, step: int) -> RecordedStep:
        """A step without a gap.

        Raises:
            MessageError: a message cannot be used.
        """
        decided, team = self._decided[step], self._config.team
        arrived: dict[str, list[Any]] = {vehicle: [] for vehicle in team.vehicles}
        for topic, stamp_ns in decided.inputs:
            vehicle, source = self._sources[topic]
            read = partial(wire(source).from_msg, vehicle=vehicle, team=team.vehicles)
            arrived[vehicle].append((source, self._first(topic, stamp_ns, read)))
        given = {vehicle: VehicleMeasurements.collect(each) for vehicle, each in arrived.items()}
        stamp_ns = self._stamp_ns(step)
        formation, parameters = self._formations.get(step), self._parameters.get(step)
        return RecordedStep(
            TeamMeasurements(step, stamp_ns, given),
            None if formation is None else formation.formation,
            {} if parameters is None else parameters.changes,
            tuple(self._requests[step]),
            decided.sqp_steps,
            {
                vehicle: self._first(
                    topic, self._answer_ns(step), partial(rotor_command_from_msg, vehicle=vehicle)
                )
                for vehicle, topic in self._answers(step).items()
            },
            step in self._taken_over,
        )

    def _first(self, topic: str, stamp_ns: int, read: Callable[[Any], Any]) -> Any:
        """The first message of a stamp that can be used: that is the one that the controller has used.

        Raises:
            MessageError: none can be used.
        """
        messages = self._messages[topic, stamp_ns]
        for message in messages[:-1]:
            with suppress(RejectionError):
                return read(decode(message))
        return read(decode(messages[-1]))

    def _answers(self, step: int) -> dict[str, str]:
        """Topics of the commands of a step, by vehicle: none while the controller waits for measurements."""
        is_answered = self._config.ground is not None or not self._decided[step].waiting_for
        return self._commands if is_answered else {}

    def _add_event(self, event: PerStep[Event]) -> None:
        match event.value.content:
            case FormationSet() as formation:
                self._formations[event.step] = formation
            case ParametersSet() as parameters if event.value.source == self._controller.node:
                self._parameters[event.step] = parameters
            case RequestMade() as request:
                self._requests[event.step].append(request)
            case StepDecided() as decided:
                self._decided[event.step] = decided
            case TakenOver():
                self._taken_over.add(event.step)

    def _stamp_ns(self, step: int) -> int:
        return step * self._config.period_ns

    def _answer_ns(self, step: int) -> int:
        """Stamp of the commands of a step: the start of the interval that they are for."""
        return self._stamp_ns(step) + self._config.command_lead_ns

    def _named(self, step: int) -> str:
        return f"control step {step} ({self._stamp_ns(step) / NANOSECONDS_PER_SECOND:.2f} s)"
