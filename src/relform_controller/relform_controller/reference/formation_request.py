"""Formations that somebody asks for in flight: by name, as a shape, or place by place."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment

from relform_core.arrays import Array
from relform_core.blend import Blend
from relform_core.errors import ConfigError
from relform_core.formations_config import places_by_follower, shape_from_text
from relform_core.scenario_config import ScenarioConfig
from relform_core.schema import Vector3


@dataclass(frozen=True)
class FormationRequest:
    """Exactly one of these says what is wanted; the others are empty."""

    name: str = ""
    """Of a formation of the scenario."""
    shape: str = ""
    """A shape as in a scenario, in YAML."""
    places: Mapping[str, Vector3] | None = None
    """Position of every follower relative to the leader [m]."""

    def formation(self, config: ScenarioConfig) -> Mapping[str, Vector3]:
        """What is wanted: position of each follower relative to the leader, in team order [m].

        Raises:
            ConfigError: not exactly one of name, shape and places; an unknown name, or a bad shape.
        """
        given = {"name": bool(self.name), "shape": bool(self.shape), "formation": self.places is not None}
        if sum(given.values()) != 1:
            got = " and ".join(key for key, is_given in given.items() if is_given) or "none"
            raise ConfigError(f"set_formation needs exactly one of name, shape and formation (got {got})")
        if self.name:
            if self.name not in config.formations:
                known = ", ".join(sorted(config.formations))
                raise ConfigError(f"unknown formation '{self.name}', known are {known}")
            places: Mapping[str, Vector3] = config.formations[self.name]
        elif self.shape:
            places = places_by_follower(shape_from_text(self.shape, "shape"), config.team.followers)
        else:
            assert self.places is not None
            places = self.places
        return {follower: places[follower] for follower in config.team.followers}


def assigned(formation: Mapping[str, Vector3], present: Array) -> Mapping[str, Vector3]:
    """The same places, taken by the followers for which the sum of squared distances is least.

    Args:
        formation: position of each follower relative to the leader [m].
        present: where the followers are, in the same order [m], shape (follower, 3).
    """
    places = list(formation.values())
    squared = ((present[:, None] - np.array(places)[None]) ** 2).sum(axis=2)
    _, chosen = linear_sum_assignment(squared)
    return {follower: places[place] for follower, place in zip(formation, chosen.tolist(), strict=True)}


def answer(step: int, way: Blend, followers: Mapping[str, Vector3] | None) -> str:
    """What to say about a request that is accepted.

    Args:
        step: control step from which on it applies.
        way: to the new formation.
        followers: place of each follower [m], if it had to be decided; else None.
    """
    around = "" if way.detours is None else ", vehicles fly around each other"
    parts = [f"applies from step {step} on, takes {way.duration:.1f} s{around}"]
    if followers is not None:
        places = (f"{name} to [{x:g}, {y:g}, {z:g}]" for name, (x, y, z) in followers.items())
        parts.append(", ".join(places))
    return "; ".join(parts)
