"""Schema of ``team``: the vehicles of a scenario."""

from collections.abc import Sequence
from typing import Annotated, Any, Self

from pydantic import BeforeValidator, Field, model_validator

from relform_core.schema import Name, Schema

FOLLOWERS_MAX = 63
"""Bound on the number of followers that a file may give in place of names."""


def _numbered(written: Any) -> Any:
    """Names for a number of followers; anything else stays."""
    if not isinstance(written, int) or isinstance(written, bool):
        return written
    if not 1 <= written <= FOLLOWERS_MAX:
        raise ValueError(f"a number of followers must be 1 to {FOLLOWERS_MAX} (got {written})")
    return tuple(f"follower_{number}" for number in range(1, written + 1))


def check_known(what: str, name: str, vehicles: Sequence[str]) -> None:
    """Check that a vehicle is in the team.

    Args:
        what: what refers to it, as the message begins: "event 'wind' targets".
        name: of the vehicle.
        vehicles: names of all vehicles.
    Raises:
        ValueError: it is not.
    """
    if name not in vehicles:
        raise ValueError(f"{what} the unknown vehicle '{name}', known are {', '.join(vehicles)}")


_Number = Annotated[int, Field(ge=1, le=FOLLOWERS_MAX)]
_Names = Annotated[tuple[Name, ...], Field(min_length=1)]


class TeamConfig(Schema):
    """The vehicles. The team order, leader first, is the order of every axis over vehicles."""

    leader: Annotated[Name, Field(examples=["leader"])]
    """Name of the leader."""
    followers: Annotated[
        tuple[Name, ...],
        Field(min_length=1, strict=False, examples=[["follower_1", "follower_2"]]),
        BeforeValidator(_numbered, json_schema_input_type=_Number | _Names),
    ]
    """Names of the followers, or their number for follower_1, follower_2 and so on."""

    @property
    def vehicles(self) -> tuple[Name, ...]:
        """Names of all vehicles in team order."""
        return (self.leader, *self.followers)

    @model_validator(mode="after")
    def _distinct(self) -> Self:
        for name in self.vehicles:
            if self.vehicles.count(name) > 1:
                raise ValueError(f"vehicle '{name}' is named twice")
        return self
