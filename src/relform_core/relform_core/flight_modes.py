"""What a vehicle is doing between the ground and the air, and what its controller asks it to do.

A vehicle takes off, hovers and lands on its own sensors, as autopilots do; in between it flies the rotor
speeds of its controller. A request is part of every command, so that lost commands do no harm.
"""

from enum import IntEnum


class VehicleMode(IntEnum):
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


class Request(IntEnum):
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
