"""What the user asks of the team, and the answers; nothing here knows how they travel."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from relform_core.schema import Vector3


@dataclass(frozen=True)
class Command:
    """A request without values, by the name of its service."""

    service: str

    @property
    def title(self) -> str:
        """The request in words: of ``/formation/controller/take_off`` it is ``take off``."""
        return self.service.rpartition("/")[2].replace("_", " ")


@dataclass(frozen=True)
class ChangeFormation:
    """Fly another formation."""

    places: Mapping[str, Vector3]
    """Of each follower relative to the leader, in {mc} of the leader [m]."""

    @property
    def title(self) -> str:
        """The request in words."""
        return "set formation"


@dataclass(frozen=True)
class GoTo:
    """Take the leader to a place."""

    p_NB_N: Vector3
    """[m]."""
    yaw_NB: float | None
    """[rad]; None: as it is."""

    @property
    def title(self) -> str:
        """The request in words."""
        return "go to"


Request = Command | ChangeFormation | GoTo


@dataclass(frozen=True)
class Answer:
    """What came of a request."""

    accepted: bool
    text: str


@dataclass(frozen=True)
class Offer:
    """Which requests the running nodes take."""

    commands: tuple[Command, ...] = ()
    formation: bool = False
    go_to: bool = False


Reply = Callable[[Answer], None]
Submit = Callable[[Request, Reply], None]
"""Makes a request; the reply comes later, from another thread. It may be called from any thread."""
