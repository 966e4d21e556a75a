"""Formations of any number of vehicles, for tests that fly from one to the other."""

from collections.abc import Mapping

from relform_core.schema import Vector3


def vee(n_vehicles: int) -> dict[str, Vector3]:
    """Followers behind the leader on two sides, each row 1 m behind and 1 m outside the row before it."""
    places: dict[str, Vector3] = {}
    for number in range(1, n_vehicles):
        row, side = float((number + 1) // 2), -1.0 if number % 2 else 1.0
        places[f"follower_{number}"] = (-row, side * row, -0.1 * number)
    return places


def line_astern(n_vehicles: int) -> dict[str, Vector3]:
    """Followers in a line behind the leader, 1.2 m apart."""
    return {f"follower_{number}": (-1.2 * number, 0.0, 0.0) for number in range(1, n_vehicles)}


def as_yaml(formation: Mapping[str, Vector3]) -> str:
    """The value of a formation in an override."""
    return "{" + ", ".join(f"{name}: {list(place)}" for name, place in formation.items()) + "}"
