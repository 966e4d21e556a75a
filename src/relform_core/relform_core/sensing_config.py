"""Schema of ``sensing``: which vehicles of the team see each other."""

from typing import Annotated, Literal

from pydantic import BeforeValidator, Field

from relform_core import sensing_graph
from relform_core.arrays import Array
from relform_core.schema import Name, Schema, by_kind
from relform_core.sensing_graph import Edges
from relform_core.team_config import check_known


class CompleteSensing(Schema):
    """All see all."""

    kind: Literal["complete"]


class StarSensing(Schema):
    """The leader and each follower see each other."""

    kind: Literal["star"]


class RingSensing(Schema):
    """Neighbours in team order see each other; the last follower and the leader are neighbours."""

    kind: Literal["ring"]


class NearestSensing(Schema):
    """Each and its nearest others in the formation of the first phase see each other."""

    kind: Literal["nearest"]
    count: Annotated[int, Field(ge=1, examples=[3])]
    """Number of others."""


class PairsSensing(Schema):
    """These pairs see each other."""

    kind: Literal["pairs"]
    pairs: Annotated[
        tuple[Annotated[tuple[Name, Name], Field(strict=False)], ...],
        Field(strict=False, examples=[[["leader", "follower_1"], ["follower_1", "follower_2"]]]),
    ]
    """The two vehicles of each pair, by name."""


_Sensing = Annotated[
    CompleteSensing | StarSensing | RingSensing | NearestSensing | PairsSensing, Field(discriminator="kind")
]
SensingConfig = Annotated[
    _Sensing,
    BeforeValidator(by_kind, json_schema_input_type=Literal["complete", "star", "ring"] | _Sensing),
]
"""As a mapping with its ``kind``, or the kind alone."""


def sensing_edges(sensing: SensingConfig, vehicles: tuple[str, ...], places: Array) -> Edges:
    """Pairs of indices of vehicles that see each other.

    Args:
        vehicles: names in team order.
        places: of the vehicles in the first formation [m], shape (vehicle, 3).
    Raises:
        ValueError: the graph names an unknown vehicle, pairs one with itself, or is not connected.
    """
    match sensing:
        case CompleteSensing():
            edges = sensing_graph.complete(len(vehicles))
        case StarSensing():
            edges = sensing_graph.star(len(vehicles))
        case RingSensing():
            edges = sensing_graph.ring(len(vehicles))
        case NearestSensing():
            edges = sensing_graph.nearest(places, sensing.count)
        case PairsSensing():
            edges = _named_edges(sensing.pairs, vehicles)
    if apart := [vehicles[vehicle] for vehicle in sensing_graph.unconnected(len(vehicles), edges)]:
        raise ValueError(
            f"sensing '{sensing.kind}' connects {len(vehicles) - len(apart)} of {len(vehicles)} vehicles, "
            f"all must be connected: no chain of vehicles that see each other leads from '{vehicles[0]}' "
            f"to '{apart[0]}'"
        )
    return edges


def _named_edges(pairs: tuple[tuple[str, str], ...], vehicles: tuple[str, ...]) -> Edges:
    for one, other in pairs:
        for name in (one, other):
            check_known("sensing.pairs names", name, vehicles)
        if one == other:
            raise ValueError(f"sensing.pairs pairs '{one}' with itself, two vehicles are needed")
    return sensing_graph.edges_of((vehicles.index(i), vehicles.index(j)) for i, j in pairs)
