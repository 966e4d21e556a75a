"""Ways from one formation to another on which no two vehicles come too close.

A way is straight if it can be. Otherwise vehicles that would meet go around each other: each keeps the other
on its left, beside its straight way and at the heights of it. So no vehicle flies lower than it would on the
straight way, and vehicles that pass each other stay in each other's field of view.

The first point of all arrays is the leader, in whose {mc} the others move.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from relform_core.arrays import Array, Integers
from relform_core.blend import N_DETOURS, Blend, detour_weights
from relform_core.controller_config import FormationChangeConfig

REPAIRS_MAX = 80
"""Repairs after which no way counts as found: a bound on the time of the search that is the same on every
machine, about 40 ms for twelve vehicles."""
_ROUNDING = 1e-9
"""Tolerance [m]: rounding must not refuse vehicles at the smallest distance that is allowed."""
_SAMPLES = 97
"""Number of points on a path that is not straight."""
_MEETING = 0.02
"""Vehicles that are closer to each other horizontally meet head-on [m]: each moves to its right."""
_SPARE = 0.01
"""By this much more than needed a repair separates two vehicles [m]; doubled when it was not enough."""

_BOLD_FROM, _BOLDNESS = 12, 1.4
"""From this repair on, vehicles that are still too close move by this much more than needed: a crowd takes
fewer repairs."""
_LEAST_EFFECT = 1e-3
"""A detour has hardly any effect close to the ends of a way: this keeps it from growing without end there."""


@dataclass(frozen=True)
class Separation:
    """How far apart the vehicles must be during changes of formation."""

    least: float
    """Two vehicles collide when their centres are closer than this [m]."""
    margin: float
    """By this much more they are apart, unless the formations themselves are closer [m]."""

    def needed(self, start: Array, target: Array) -> Array:
        """Smallest distance of each pair on a way between two formations [m], shape (pair,).

        Two vehicles whose places have less than the margin to spare may use half of what they have.
        """
        needed: Array = self.least + np.clip(0.5 * (_closer(start, target) - self.least), 0.0, self.margin)
        return needed


def pairs(n_vehicles: int) -> tuple[Integers, Integers]:
    """Both vehicles of every pair."""
    first, second = np.triu_indices(n_vehicles, 1)
    return first, second


def _closer(start: Array, target: Array) -> Array:
    """Distance of each pair where it is closer, at the start or the target [m], shape (pair,)."""
    first, second = pairs(len(start))
    at_start, at_target = (np.linalg.norm(each[second] - each[first], axis=1) for each in (start, target))
    closer: Array = np.minimum(at_start, at_target)
    return closer


def separations(way: Blend) -> Array:
    """A lower bound on the distance of each pair on the whole way [m], shape (pair,).

    Between two samples the path of one vehicle relative to another differs from its chord by at most
    a T^2 / 8, with the relative acceleration a and the time T between the samples.
    """
    if way.straight:
        return _Approaches.of(np.stack([way.start, way.target], axis=1)).distance
    elapsed = np.linspace(0.0, way.duration, _SAMPLES)
    first, second = pairs(len(way.start))
    accelerations = way.accelerations()
    relative = np.linalg.norm(accelerations[second] - accelerations[first], axis=2).max(axis=1)
    distance: Array = _Approaches.of(way.at(elapsed)).distance - relative * elapsed[1] ** 2 / 8.0
    return distance


def is_free(way: Blend, separation: Separation) -> bool:
    """Whether all vehicles stay far enough apart."""
    return bool((separations(way) >= separation.needed(way.start, way.target) - _ROUNDING).all())


def around(straight: Blend, limits: FormationChangeConfig, separation: Separation) -> Blend | None:
    """A way on which the vehicles go around each other, for one that is not free.

    Args:
        straight: the way without detours.
        limits: of speed and acceleration.
        separation: of the vehicles.
    Returns:
        A way with the same start, velocities and target; None: no way was found.
    """
    points = (straight.start, straight.velocity, straight.target)
    return _around(*(each.tobytes() for each in points), straight.duration, limits, separation)


@lru_cache(maxsize=64)  # a request is checked, then made, then begun: one search
def _around(
    start: bytes,
    velocity: bytes,
    target: bytes,
    duration: float,
    limits: FormationChangeConfig,
    separation: Separation,
) -> Blend | None:
    p, v, q = (np.frombuffer(each).reshape(-1, 3) for each in (start, velocity, target))
    way = Blend(p, v, q, duration, np.zeros((len(p), N_DETOURS, 3)))
    needed = separation.needed(p, q)
    repairs_left, spare = REPAIRS_MAX, _SPARE
    while repairs_left > 0:
        wanted = np.minimum(needed + spare, 0.5 * (needed + _closer(p, q)))
        detours, repairs = _repaired(way, wanted, repairs_left)
        way = Blend.within(p, v, q, limits.speed_max, limits.acceleration_max, detours, way.duration)
        if (separations(way) >= needed - _ROUNDING).all():
            return way
        # With detours it takes longer, and vehicles that already move then fly another way.
        repairs_left, spare = repairs_left - repairs - 1, 2.0 * spare
    return None


def _repaired(way: Blend, needed: Array, repairs_max: int) -> tuple[Array, int]:
    """Detours on which the samples of all pairs are ``needed`` [m] apart, and the number of repairs made.

    Every repair moves each pair that is too close aside, by a little more than needed, where it is closest.
    """
    elapsed = np.linspace(0.0, way.duration, _SAMPLES)
    share = _share(_SAMPLES)
    weights, _, _ = detour_weights(share)
    straight = Blend(way.start, way.velocity, way.target, way.duration).at(elapsed)
    assert way.detours is not None
    detours = way.detours.copy()
    first, second = pairs(len(way.start))
    part_of_second = np.where(first == 0, 1.0, 0.5)  # the leader flies no detour
    for repairs in range(repairs_max):
        approaches = _Approaches.of(straight + np.einsum("pcx,ct->ptx", detours, weights))
        close = np.flatnonzero(approaches.distance < needed)
        if not close.size:
            return detours, repairs
        aside = approaches.aside(close, needed[close] + _SPARE)
        if repairs >= _BOLD_FROM:
            aside *= _BOLDNESS
        by_control_point = approaches.weights(close, weights)
        effect = (by_control_point**2).sum(axis=0) + _LEAST_EFFECT
        push = aside[:, None] * (by_control_point / effect).T[:, :, None]
        part = part_of_second[close, None, None]
        np.add.at(detours, second[close], part * push)
        np.add.at(detours, first[close], (part - 1.0) * push)
    return detours, repairs_max


def _share(n_samples: int) -> Array:
    """Share of the way at samples that are evenly spaced in time."""
    x = np.linspace(0.0, 1.0, n_samples)
    return x * x * (3.0 - 2.0 * x)


@dataclass(frozen=True, eq=False)
class _Approaches:
    """Where the vehicles of each pair are closest to each other, on paths that are polylines."""

    distance: Array
    """[m], shape (pair,)."""
    offset: Array
    """Second vehicle minus first [m], shape (pair, 3)."""
    along: Array
    """The line on which the second one passes the first there, shape (pair, 3)."""
    segment: Integers
    """Number of the segment, shape (pair,)."""
    position: Array
    """Place on the segment, from 0 to 1, shape (pair,)."""

    @classmethod
    def of(cls, path: Array) -> "_Approaches":
        """On paths of shape (vehicle, instant, 3)."""
        first, second = pairs(len(path))
        relative = path[second] - path[first]
        start, along = relative[:, :-1], np.diff(relative, axis=1)
        squared = np.maximum((along**2).sum(axis=2), np.finfo(np.float64).tiny)
        position = np.clip(-(start * along).sum(axis=2) / squared, 0.0, 1.0)
        offset = start + along * position[:, :, None]
        distance = np.linalg.norm(offset, axis=2)
        segment = distance.argmin(axis=1)
        at = np.arange(len(first)), segment
        return cls(distance[at], offset[at], along[at], segment, position[at])

    def aside(self, close: Integers, needed: Array) -> Array:
        """By how much the second vehicle of each pair in ``close`` must move away [m], shape (pair, 3)."""
        offset, along = self.offset[close], self.along[close]
        horizontal = offset * (1.0, 1.0, 0.0)
        distance = np.linalg.norm(horizontal, axis=1)
        right = np.stack([along[:, 1], -along[:, 0], np.zeros(len(close))], axis=1)
        right[~right.any(axis=1)] = (0.0, -1.0, 0.0)  # one passes the other vertically
        direction = np.where(distance[:, None] < _MEETING, right, horizontal)
        direction /= np.linalg.norm(direction, axis=1)[:, None]
        wanted = np.sqrt(np.maximum(needed**2 - offset[:, 2] ** 2, 0.0))
        aside: Array = direction * (wanted - distance)[:, None]
        return aside

    def weights(self, close: Integers, weights: Array) -> Array:
        """Those where the pairs in ``close`` are closest, from those at the samples; by control point."""
        segment, position = self.segment[close], self.position[close]
        found: Array = weights[:, segment] * (1.0 - position) + weights[:, segment + 1] * position
        return found
