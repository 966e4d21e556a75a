"""The order of the parts of the panel, from top to bottom."""

from enum import IntEnum


class Place(IntEnum):
    """Where a part of the panel is."""

    NUMBERS = 0
    PLAYBACK = 1
    COMMANDS = 2
    FORMATION = 3
    GO_TO = 4
    PLOT = 5
    EVENTS = 6
    SHOW = 7
