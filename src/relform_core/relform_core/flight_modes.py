"""What a vehicle and a team are doing between the ground and the air, and what they may be asked to do.

A vehicle takes off, hovers and lands on its own sensors, as autopilots do; in between it flies the rotor
speeds of its controller. A request to a vehicle is part of every command, so that lost commands do no harm.
"""

from collections.abc import Mapping
from enum import Enum, IntEnum


class _Spoken(IntEnum):
    """An enum whose members are said in words."""

    def __str__(self) -> str:
        return self.name.lower().replace("_", " ")


class VehicleMode(_Spoken):
    """What a vehicle does; the numbers of FlightStatus.msg."""

    IDLE = 0
    """On the ground, motors off."""
    ARMED = 1
    """On the ground, motors idle."""
    TAKING_OFF = 2
    """Climbs straight up on its own sensors."""
    HOVERING = 3
    """Stays in the air on its own sensors."""
    FLYING = 4
    """Flies the rotor speeds of its controller."""
    LANDING = 5
    """Sinks straight down on its own sensors, to the ground."""
    FAILSAFE = 6
    """Has no plan left: levels out and sinks on its own sensors."""
    STOPPED = 7
    """Motors cut, for the rest of the flight."""


ON_THE_GROUND = frozenset({VehicleMode.IDLE, VehicleMode.ARMED, VehicleMode.STOPPED})
"""Modes of a vehicle that needs no commands; one that was stopped in the air will be there soon."""


class Request(_Spoken):
    """What a command asks a vehicle to do; the numbers of RotorSpeeds.msg."""

    FLY = 0
    """Fly the rotor speeds of the command, and its plan."""
    REST = 1
    """Stay on the ground with motors off."""
    ARM = 2
    """Stay on the ground with motors idle."""
    TAKE_OFF = 3
    """Climb to the height of take-off, then hover."""
    HOVER = 4
    """Brake and stay in the air."""
    LAND = 5
    """Sink to the ground, then rest."""
    STOP = 6
    """Cut the motors, wherever the vehicle is."""


class TeamMode(_Spoken):
    """What a team does; the numbers of TeamStatus.msg."""

    IDLE = 0
    """All vehicles are on the ground, motors off."""
    TAKING_OFF = 1
    """The vehicles climb one after the other, then form up."""
    HOVERING = 2
    """In formation, the leader stays where it is."""
    FLYING = 3
    """In formation, the leader flies the phases of the scenario, to a place, or a trajectory."""
    LANDING = 4
    """The vehicles sink to the ground."""
    FAILSAFE = 5
    """Something went wrong: all vehicles land where they are."""
    STOPPED = 6
    """Motors cut, for the rest of the flight."""
    TAKING_OVER = 7
    """A controller that was started in flight asks the vehicles in the air to hover, then forms up."""


class TeamRequest(Enum):
    """What a team may be asked to do; the values are the names of the services."""

    TAKE_OFF = "take_off"
    START = "start"
    """Fly the phases of the scenario."""
    HOVER = "hover"
    """Brake and stay in formation."""
    GO_TO = "go_to"
    """Take the leader to a place."""
    FOLLOW_TRAJECTORY = "follow_trajectory"
    """Take the leader along a path with given times."""
    SET_FORMATION = "set_formation"
    LAND = "land"
    EMERGENCY_LAND = "emergency_land"
    """All vehicles land at once where they are, whatever is below them."""
    EMERGENCY_STOP = "emergency_stop"
    """Cut the motors of all vehicles, wherever they are."""


_IN_FORMATION = frozenset({TeamMode.HOVERING, TeamMode.FLYING})
_IN_THE_AIR = _IN_FORMATION | {TeamMode.TAKING_OFF, TeamMode.TAKING_OVER, TeamMode.LANDING}

ALLOWED: Mapping[TeamRequest, frozenset[TeamMode]] = {
    TeamRequest.TAKE_OFF: frozenset({TeamMode.IDLE}),
    TeamRequest.START: frozenset({TeamMode.HOVERING}),
    TeamRequest.HOVER: _IN_FORMATION,
    TeamRequest.GO_TO: _IN_FORMATION,
    TeamRequest.FOLLOW_TRAJECTORY: _IN_FORMATION,
    TeamRequest.SET_FORMATION: _IN_FORMATION,
    TeamRequest.LAND: _IN_FORMATION,
    TeamRequest.EMERGENCY_LAND: _IN_THE_AIR,
    TeamRequest.EMERGENCY_STOP: frozenset(TeamMode) - {TeamMode.STOPPED},
}
"""The modes in which a team takes a request."""


def refusal(request: TeamRequest, mode: TeamMode) -> str | None:
    """Why a team in a mode refuses a request, in words; None: it takes it."""
    allowed = ALLOWED[request]
    if mode in allowed:
        return None
    expected = " or ".join(str(each) for each in sorted(allowed))
    return f"{request.value} is refused: the team is {mode}, expected {expected}"
