"""What is done to a flight, and when: drawn from the kind of a case and its seed."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np

from relform_core.errors import ConfigError
from relform_core.randomness import Stream, spawn_generator

VEHICLES = ("leader", "follower_1", "follower_2")
VEHICLE = "vehicle"
"""Any of these."""
CONTROLLER, CLOCK, RECORDER, FLY, VIEWER = "controller", "clock", "recorder", "fly", "viewer"
NODES = (*VEHICLES, CONTROLLER, CLOCK, RECORDER)
"""The processes of a flight that is started node by node."""


END_S = 30.0
"""In which all processes must have ended [s]; DDS takes 20 s to believe that a killed one is gone."""


@dataclass(frozen=True)
class Case:
    """One flight of the campaign."""

    kind: str
    seed: int

    def __str__(self) -> str:
        return f"{self.kind}:{self.seed}"

    @classmethod
    def parse(cls, text: str) -> "Case":
        """The case of a text such as ``kill-controller:4711``.

        Raises:
            ConfigError: it has another form.
        """
        kind, colon, seed = text.partition(":")
        if not (kind and colon and seed.isdecimal()):
            raise ConfigError(f"case must be KIND:SEED, as in kill-controller:4711 (got '{text}')")
        return cls(kind, int(seed))


class Action(StrEnum):
    """What can be done to a process or to the machine that it sees."""

    KILL = "killed"
    STOP = "stopped"
    CONTINUE = "continued"
    START = "started"
    INTERRUPT = "interrupted"
    JUMP_CLOCK = "clock moved by (s)"
    SLOW_DISK = "every write takes (s)"
    PIN = "on one core"
    UNPIN = "on all cores"
    BUSY = "busy loop on that core for (s)"
    FOREIGN = "foreign messages for (s)"


@dataclass(frozen=True)
class Fault:
    """One thing that is done."""

    time: float
    """After the first tick of the clock [s]."""
    action: Action
    target: str
    """Name of a process: one of NODES, ``fly``, or that of an additional process; or ``all``."""
    value: float = 0.0
    count: int = 1
    """Of foreign messages for each one of the flight."""


@dataclass(frozen=True)
class Plan:
    """A flight of the campaign."""

    overrides: tuple[str, ...]
    """Changes of the paper's scenario, ``key=value``."""
    duration: float
    """Length of the flight [s]."""
    faults: tuple[Fault, ...]
    """In the order of time."""
    order: tuple[str, ...] = NODES
    """In which the processes are started; ``fly`` alone starts all."""
    late: Mapping[str, float] = field(default_factory=dict)
    """Processes that are started later than the others [s]."""
    disk_bytes: int = 0
    """Size of the disk of the bag; 0: that of the machine."""
    is_ended_by_fault: bool = False
    """Whether the flight ends soon after its last fault, and not at its planned end."""

    @property
    def ends_by(self) -> float:
        """When all processes must have ended, after the first tick; later is a hang [s]."""
        last = self.faults[-1].time if self.faults else 0.0
        return (last if self.is_ended_by_fault else max(last, self.duration)) + END_S

    def times(self, action: Action) -> tuple[float, ...]:
        """When an action is taken [s]."""
        return tuple(fault.time for fault in self.faults if fault.action is action)

    @property
    def disturbed(self) -> float:
        """From the first to the last fault [s]."""
        return self.faults[-1].time - self.faults[0].time if self.faults else 0.0


MOTIONS = {
    "hover": "{kind: hover, ramp_s: 0.0}",
    "line": "{kind: straight, speed_m_s: 1.5, ramp_s: 1.5}",
    "turn": "{kind: turn, angle_deg: 90.0, turn_s: 3.0}",
}


FORMATIONS = (
    "formations_m={initial: {follower_1: [-1.0, -1.0, -0.4], follower_2: [-1.0, 1.0, -0.4]}, "
    "wide: {follower_1: [-1.0, -1.2, -0.4], follower_2: [-1.0, 1.2, -0.4]}}"
)
"""With room between the vehicles: on a busy machine many commands come late."""


class Draw:
    """The draws of one case."""

    def __init__(self, case: Case) -> None:
        self._generator: np.random.Generator = spawn_generator(case.seed, 0, Stream.FAULTS)
        self._seed = case.seed

    def between(self, low: float, high: float) -> float:
        """A number, uniform, with milliseconds."""
        return round(float(self._generator.uniform(low, high)), 3)

    def one_of(self, *names: str) -> str:
        """One of some names, all equally likely."""
        return names[int(self._generator.integers(len(names)))]

    def order(self, *names: str) -> tuple[str, ...]:
        """Names in any order."""
        return tuple(names[index] for index in self._generator.permutation(len(names)))

    def flight(
        self, duration: float, motions: Sequence[str] = tuple(MOTIONS), sinks_slowly: bool = False
    ) -> tuple[str, ...]:
        """Overrides of a flight: one of some motions, from another height and with another yaw.

        Args:
            duration: [s].
            motions: keys of MOTIONS.
            sinks_slowly: whether vehicles without commands stay in the air until a process has started.
        """
        motion = MOTIONS[self.one_of(*motions)]
        phase = "name: A, title: faults, steady_from_s: 0.0, formation: initial"
        height, yaw = self.between(1.4, 2.2) + sinks_slowly, self.between(-170.0, 170.0)
        return (
            "controller=team",
            FORMATIONS,
            "pacing=real_time",
            f"phases=[{{{phase}, duration_s: {duration}, motion: {motion}}}]",
            f"start.position_m=[0.5, -0.3, {height}]",
            f"start.yaw_deg={yaw}",
            f"vehicle.failsafe={{plan_max_s: 1.0, descent_speed_m_s: {0.2 if sinks_slowly else 0.6}}}",
        )
