"""What a flight of the campaign leaves behind: how its processes ended, and what its bag says."""

from collections.abc import Mapping
from dataclasses import dataclass

from relform_core.arrays import Array, Integers
from relform_core.flight_modes import TeamMode, VehicleMode


@dataclass(frozen=True)
class Ended:
    """A process of a flight that has ended."""

    name: str
    """The second process of a name is ``name_1``, and so on."""
    code: int | None
    """Exit code, minus the number of a signal that ended it; None: it ran on until it was killed."""
    output: str
    was_killed: bool = False
    """Whether the campaign killed it as a fault."""
    was_dismissed: bool = False
    """Whether it was started so late that the flight was over, and then interrupted."""

    @property
    def lines(self) -> tuple[str, ...]:
        """What it printed, without empty lines."""
        return tuple(line for line in self.output.splitlines() if line.strip())


@dataclass(frozen=True, eq=False)
class VehicleFlown:
    """One vehicle in a bag; instants are those of the flight [s]."""

    times: Array
    """Of its ground truth, shape (T,)."""
    heights: Array
    """[m], shape (T,)."""
    speeds: Array
    """[m/s], shape (T,)."""
    tilts: Array
    """Between its vertical axis and that of the world [rad], shape (T,)."""
    command_times: Array
    """When commands were sent, shape (K,)."""
    requests: Integers
    """What each command asks for, numbers of ``Request``, shape (K,)."""
    modes: tuple[tuple[float, VehicleMode], ...]
    """Time and mode, at each change."""


@dataclass(frozen=True, eq=False)
class Flown:
    """What a bag says about a flight."""

    steps: Integers
    """Of which there is ground truth of all vehicles, shape (T,)."""
    vehicles: Mapping[str, VehicleFlown]
    vehicle_faults: tuple[str, ...]
    """Reasons that vehicles gave for why they cannot continue."""
    admissions: tuple[tuple[float, str, bool], ...]
    """The clock's decisions: instant [s], name of the node, whether it was admitted."""
    team_modes: tuple[tuple[float, TeamMode], ...]
    formation_errors: Array
    """Mean of the scored pairs in each control step [m], shape (K,); of those with a reference."""
    error_times: Array
    """Their instants [s], shape (K,)."""
    reports: Mapping[str, Mapping[str, str]]
    """The newest diagnostics of each node, by key."""


@dataclass(frozen=True)
class Evidence:
    """Of one flight."""

    ends: tuple[Ended, ...] = ()
    """In the order of their starts; a process that was started twice is here twice."""
    orphans: tuple[str, ...] = ()
    """Command lines of processes that were left."""
    wall: float = 0.0
    """From the start of the first process to the end of the last [s]."""
    done: tuple[float, ...] = ()
    """When each fault of the plan was done: instants of the flight [s]."""
    ticked: float = -1.0
    """The newest instant that the clock has announced [s]; negative: none."""
    flown: Flown | None = None
    """By the bag of the last recorder."""
    bag_problem: str = ""
    """Why the bag cannot be read, or in what two readers differ."""
