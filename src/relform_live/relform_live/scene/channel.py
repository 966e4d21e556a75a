"""A topic of the view: where its messages go."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Channel:
    """What takes in the messages of a topic."""

    take: Callable[[Any], None]
    """Takes in a message; raises MessageError if it cannot be used."""
    kept: int = 1
    """How many of the messages between two frames are taken in: the newest."""
    keeps_all: bool = False
    """Whether each message counts, however old it is: it is an event."""
